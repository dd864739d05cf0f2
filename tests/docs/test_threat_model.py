"""The threat model's limits are those of the code, and its tests and readers are there."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "threat_model.md").read_text()
ROWS = re.findall(r"^\| (.+?) \| ([\d,.]+(?: \w+)?) \| `([\w.]+):([\w.]+)` \|$", PAGE, re.MULTILINE)
UNITS = {"": 1, "GiB": 1 << 30, "MiB": 1 << 20, "KiB": 1 << 10, "s": 1, "GB": 1}  # run.memory_gb is a number of GB


def value_of(module: str, name: str) -> Any:
    """The value of a constant, or the default of a field of a model or data class."""
    found: Any = import_module(module)
    for part in name.split("."):
        is_model = isinstance(found, type) and issubclass(found, BaseModel)
        found = found.model_fields[part].default if is_model else getattr(found, part)
    return found


@pytest.mark.parametrize(("what", "said", "module", "name"), ROWS, ids=[f"{row[2]}:{row[3]}" for row in ROWS])
def test_a_limit_is_that_of_the_code(what: str, said: str, module: str, name: str) -> None:
    number, _, unit = said.replace(",", "").partition(" ")
    assert float(number) * UNITS[unit] == value_of(module, name), what


def test_every_row_of_the_table_is_compared() -> None:
    table = PAGE.partition("## Which limit holds where")[2].partition("\n## ")[0]
    rows = [line for line in table.splitlines() if line.startswith("|")]
    assert len(ROWS) == len(rows) - 2 > 20


def test_security_says_what_the_commands_are() -> None:
    text = (ROOT / "SECURITY.md").read_text()
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert {"licences", "vulnerabilities"} == set(re.findall(r"`make ([\w-]+)`", text)) <= targets
    assert all((ROOT / link).exists() for link in re.findall(r"\]\(([^)#:]+)\)", text))
