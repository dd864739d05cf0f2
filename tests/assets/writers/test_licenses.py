"""Licences: what may go out, and what goes with it."""

from __future__ import annotations

from pathlib import Path

import pytest

import exported_twins as made
from manitwin.assets.writers.licenses import allowed_licenses, check_license, license_text
from manitwin.assets.writers.write import export_twin
from manitwin.errors import ExportError, UsageError


def test_a_licence_on_the_list_goes_out_in_any_case(tmp_path: Path) -> None:
    record = made.content(tmp_path / "twin").record
    check_license(record, ["cc0-1.0", "cc-by-4.0"])
    check_license(record, None)
    with pytest.raises(ExportError, match=r"its licence is CC-BY-4\.0, which --license-allow does not name"):
        check_license(record, ["CC-BY-4"])  # no part of a name is the name


@pytest.mark.parametrize("licence", ["unknown", "", " \n"])
def test_an_unknown_licence_goes_out_only_where_it_is_named(licence: str, tmp_path: Path) -> None:
    twin = made.content(tmp_path / "twin", source={"license": licence})
    with pytest.raises(ExportError, match="its licence is unknown"):
        export_twin(twin, "urdf", tmp_path / "out", license_allow=["CC-BY-4.0"])
    assert not (tmp_path / "out").exists()
    main = export_twin(twin, "urdf", tmp_path / "out", license_allow=["CC-BY-4.0", "UNKNOWN"])
    assert "find it out before you pass these files on" in (main.parent / "LICENSE.txt").read_text()


def test_an_empty_list_is_a_mistake() -> None:
    with pytest.raises(UsageError, match="names no licence"):
        allowed_licenses(["", " "])


@pytest.mark.parametrize("name", ["mjcf", "urdf", "sdf", "glb"])
def test_licence_and_credit_are_in_every_export(name: str, tmp_path: Path) -> None:
    twin = made.content(tmp_path / "twin")
    export_twin(twin, name, tmp_path / "out")
    folder = tmp_path / "out" / made.NAME / name
    text = (folder / "LICENSE.txt").read_text()
    for word in (
        "CC-BY-4.0",
        "Ada Lovelace",
        twin.record.source.sha256,
        "spdx.org/licenses/CC-BY-4.0",
        "2 holes closed",
    ):
        assert word in text
    stated = [p for p in folder.rglob("*") if p.suffix in (".xml", ".urdf", ".sdf", ".glb") and p.name != "visual.glb"]
    assert stated and all(b"CC-BY-4.0" in p.read_bytes() and b"Ada Lovelace" in p.read_bytes() for p in stated)


def test_a_licence_that_asks_for_an_author_who_is_not_known_is_pointed_out(tmp_path: Path) -> None:
    record = made.content(tmp_path / "twin", source={"attribution": None}).record
    assert "no author is known" in license_text(record)
