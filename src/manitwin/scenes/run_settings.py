"""Settings of a run that makes layouts or episodes: loading, and comparison with those of earlier runs in its folder."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

from manitwin.config import Section, read_toml, validate_settings
from manitwin.engine.ledger.location import CONFIG, local_ledger
from manitwin.engine.ledger.reading import read_ledger
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot

Application = TypeVar("Application", bound=Section)


def load_settings(kind: type[Application], file: Path | None, given: dict[str, Any]) -> Application:
    """Return the settings of an application: those ``given`` by the caller, over those of a TOML file, if one is named.

    A given None means not given; a given dict is merged into its section. Raises ConfigError naming the file, or the command
    line, and the key.
    """
    said = {} if file is None else read_toml(file)
    validate_settings(kind, said, str(file))
    for name, value in given.items():
        if isinstance(value, dict):
            said[name] = {**said.get(name, {}), **value}
        elif value is not None:
            said[name] = value
    return validate_settings(kind, said, "the command line")


def earlier_settings(root: DatasetRoot) -> dict[str, Any]:
    """Return the configuration of the last run at a root; empty if there was none."""
    return (
        root.read_json(CONFIG, UsageError, remedy="remove it: the next run writes a new one")
        if root.exists(CONFIG)
        else {}
    )


def check_settings(root: DatasetRoot, now: Mapping[str, Any], *, free: frozenset[str], made: str) -> None:
    """Raise UsageError if finished items at a root were made with other settings, or by another command.

    ``free`` names the sections and settings that do not affect items. ``made`` is the plural noun for the items. Settings that
    the earlier version did not have are ignored.
    """
    earlier = earlier_settings(root)
    if earlier and earlier.get("kind") != now["kind"]:
        raise UsageError(f"{root.url}: contains {earlier.get('kind', 'twins')}, not {now['kind']}; give another folder")
    before = dict(_flat(earlier))
    differ = [
        f"{name}: {json.dumps(before[name])} there, {json.dumps(value)} now"
        for name, value in _flat(json.loads(json.dumps(now)))
        if name in before and before[name] != value and name.partition(".")[0] not in free
    ]
    if not differ or not (ledger := local_ledger(root)).is_file():
        return
    with read_ledger(ledger) as connection:
        (count,) = connection.execute("SELECT count(*) FROM items WHERE state = 'accepted'").fetchone()
    if count:
        raise UsageError(
            f"{root.url}: {count} {made} in it were made with other settings ({'; '.join(differ)});"
            " give the same settings to add to it, or another folder"
        )


def _flat(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in settings.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
