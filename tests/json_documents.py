"""The keys of ``--json`` documents, as they are and as docs/json.md says."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

PAGE = Path(__file__).resolve().parents[1] / "docs" / "json.md"
SHARED = ("causes[]", "remarks[]", "folders[]")
"""What the other sections have as that of build has it."""
RUN = {"out", "counts", "left_waiting", "stopped", "exit_status", *SHARED}


def check_keys(document: dict[str, Any], section: str) -> None:
    """Assert that a document has the keys that its section names, but for those inside of what is empty or null."""
    said = documented(section)
    free = {key for key in said if key.endswith("{}")}
    told = set(keys_of(document, free))
    assert told <= said, f"not documented: {sorted(told - said)}"
    inside = {key for key in said if "." in key and key.rpartition(".")[0] not in parents(told)}
    assert said - told <= inside, f"documented and not there: {sorted(said - told - inside)}"
    assert {key for key in said if "." not in key} == {key for key in told if "." not in key}


def documented(section: str) -> set[str]:
    """The keys in a section's tables: ``a.b``, ``a[].b`` of a list, ``a{}`` of an object of free keys."""
    page = PAGE.read_text()
    found = re.search(rf"^## `manitwin {re.escape(section)} --json`\n(.*?)(?=^## |\Z)", page, re.M | re.S)
    assert found is not None, section
    keys: set[str] = (
        {key for key in documented("layout") if key.split(".")[0] in RUN} if "What `layout` says" in found[1] else set()
    )
    for first, second in re.findall(r"^\| (`.*?) \| (.*?) ?\|$", found[1], re.M):
        own = re.findall(r"`([^`]+)`", first)
        keys |= {*own, *(key for key in re.findall(r"`([a-z_.{}\[\]]+)`", second) if key.startswith(within(own)))}
    if "dry-run" not in section and section != "build":
        keys |= {key for key in documented("build") if key.startswith(within([k for k in SHARED if k in keys]))}
    return keys


def within(keys: list[str]) -> tuple[str, ...]:
    return tuple(f"{key}." for key in keys)


def parents(keys: set[str]) -> set[str]:
    return {key.rpartition(".")[0] for key in keys}


def keys_of(value: Any, free: set[str], path: str = "") -> Iterator[str]:
    """The keys of a document in the same notation; what is in ``free`` is not looked into."""
    for key, each in value.items():
        name = f"{path}.{key}" if path else key
        if f"{name}{{}}" in free:
            assert each is None or isinstance(each, dict), name
            yield f"{name}{{}}"
        elif isinstance(each, list):
            yield f"{name}[]"
            for element in each:
                if isinstance(element, dict):
                    yield from keys_of(element, free, f"{name}[]")
        else:
            yield name
            if isinstance(each, dict):
                yield from keys_of(each, free, name)
