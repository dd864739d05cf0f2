"""Formats of other packages stand beside the built-in ones."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import exported_twins
from manitwin.assets.writers.registry import chosen_formats, exporter, formats
from manitwin.assets.writers.write import export_twin
from manitwin.errors import UsageError
from manitwin.models.builtin import BACKENDS
from manitwin.models.registry import backends

MODULE = """
from manitwin.backends import Exported

BACKENDS = {"exporter": {"mass": "mass_format:export", "broken": "mass_format:nothing"}}


def export(twin):
    return Exported({"mass.txt": f"{twin.physical.mass_kg.value}".encode()}, main="mass.txt")
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """An installed package as pip leaves it: a module, and its entry points."""
    (tmp_path / "mass_format.py").write_text(MODULE)
    information = tmp_path / "mass_format-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: mass-format\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text("[manitwin.backends]\nmass = mass_format\n")
    monkeypatch.syspath_prepend(tmp_path)
    backends.cache_clear()
    yield
    backends.cache_clear()


@pytest.mark.usefixtures("package")
def test_formats_of_a_package_come_after_the_built_in_ones() -> None:
    assert formats() == (*BACKENDS["exporter"], "broken", "mass")
    assert chosen_formats(["mass", "mjcf"]) == ("mjcf", "mass")
    assert "mass" in chosen_formats(None)


@pytest.mark.usefixtures("package")
def test_a_format_of_a_package_is_written_like_any_other(tmp_path: Path) -> None:
    twin = exported_twins.content(tmp_path)
    main = export_twin(twin, "mass", tmp_path / "out")
    assert main == tmp_path / "out" / twin.name / "mass" / "mass.txt"
    assert float(main.read_text()) == twin.physical.mass_kg.value
    assert (main.parent / "LICENSE.txt").is_file()
    readme = (main.parent / "README.md").read_text()
    assert "the format's package does not tell" in readme
    assert "nothing that the twin knows" not in readme, "nobody said so"


@pytest.mark.usefixtures("package")
def test_an_exporter_that_is_not_there_is_one_line() -> None:
    with pytest.raises(UsageError, match=r"'broken' cannot be loaded.*choose another format"):
        exporter("broken")


def test_without_the_package_its_format_is_unknown_and_the_valid_ones_are_listed() -> None:
    with pytest.raises(UsageError, match=r"unknown format 'mass'.*mjcf"):
        exporter("mass")
