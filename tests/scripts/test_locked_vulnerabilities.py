"""What an index says of locked versions is reported; a version of which it says nothing is not taken for a sound one."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"

ADVISORY = {"id": "PYSEC-2026-1", "fixed_in": ["1.1"], "withdrawn": None}


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    """The script as a module."""
    sys.path.insert(0, str(SCRIPTS))
    try:
        yield importlib.import_module("locked_vulnerabilities")
    finally:
        sys.path.remove(str(SCRIPTS))


def page(version: str, *advisories: dict[str, Any]) -> dict[str, Any]:
    return {"info": {"version": version}, "vulnerabilities": list(advisories)}


@pytest.mark.parametrize(
    ("pages", "advisories"),
    [
        ({"x/1.0": page("1.0")}, {}),
        ({"x/1.0": page("1.0", ADVISORY)}, {"PYSEC-2026-1": ["1.1"]}),
        ({"x": page("1.0", ADVISORY)}, {"PYSEC-2026-1": ["1.1"]}),
        ({"x": page("2.0")}, None),
        ({"x/1.0": page("1.0", {**ADVISORY, "withdrawn": "2026-01-01"})}, {}),
        ({}, None),
        ({"x/1.0": {"info": {"version": "1.0"}}}, None),
    ],
)
def test_only_what_the_index_says_of_that_version_counts(
    script: ModuleType, pages: dict[str, Any], advisories: dict[str, list[str]] | None
) -> None:
    assert script.known("x", "1.0", pages.get).advisories == advisories


def test_the_status_says_what_was_found(script: ModuleType, capsys: pytest.CaptureFixture[str]) -> None:
    sound, bad, silent = (
        script.Known("a", "1.0", {}),
        script.Known("b", "1.0", {"PYSEC-2026-1": ["1.1"]}),
        script.Known("c", "1.0", None),
    )
    assert script.report([sound]) == 0
    assert script.report([sound, silent]) == 4
    assert "c 1.0" in capsys.readouterr().err
    assert script.report([sound, bad, silent]) == 1
    assert "b 1.0: PYSEC-2026-1, mended in 1.1" in capsys.readouterr().out
