"""``manitwin export``: which twins are meant, what is refused, and the exit status."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import typer

import exported_twins as made
from manitwin.cli.commands.export import export
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import twin_name


def said(capsys: pytest.CaptureFixture[str], *twins: Path | str, **options: Any) -> tuple[int, str, str]:
    """Return the exit status and what was said on either stream."""
    with pytest.raises(typer.Exit) as ended:
        export([str(twin) for twin in twins], **{"to": "urdf", "license_allow": None, **options})
    said = capsys.readouterr()
    return ended.value.exit_code, said.out, said.err


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    root = tmp_path / "set"
    made.write_twin(root / twin_name(made.TWIN_ID))
    made.write_twin(root / twin_name("0123456789abcdef"), twin_id="0123456789abcdef", language={"category": "mug"})
    return root


def test_a_twin_in_two_formats(dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    status, told, _ = said(capsys, dataset / twin_name(made.TWIN_ID), out=out, to="mjcf,URDF")
    assert status == 0
    assert told.splitlines() == [f"{made.NAME}: mjcf, urdf", f"1 twin exported to {out}"]
    assert (out / made.NAME / "mjcf" / f"{made.NAME}.xml").is_file()
    assert (out / made.NAME / "urdf" / "README.md").is_file()


def test_a_data_set_gives_all_its_twins_each_once(
    dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made.write_twin(dataset / ".work" / "half")
    status, told, _ = said(capsys, dataset, dataset / twin_name(made.TWIN_ID), out=tmp_path / "out")
    assert (status, told.splitlines()[-1]) == (0, f"2 twins exported to {tmp_path / 'out'}")
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [made.NAME, "mug_01234567"]


def test_a_data_set_behind_a_url(dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import fsspec

    memory = fsspec.filesystem("memory")
    memory.put(str(dataset) + "/", "memory://exported/set/", recursive=True)
    try:
        status, _, _ = said(capsys, "memory://exported/set", out=tmp_path / "out")
    finally:
        memory.rm("/exported", recursive=True)
    assert status == 0
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [made.NAME, "mug_01234567"]


def test_a_rejected_twin_is_refused_with_a_line(
    dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made.write_rejected(dataset / twin_name("0" * 16))
    status, told, refused = said(capsys, dataset, out=tmp_path / "out", license_allow="CC-BY-4.0")
    assert status == 3
    assert "rejected (two objects)" in refused and len(refused.splitlines()) == 1
    assert told.splitlines()[-1] == f"2 twins exported to {tmp_path / 'out'}, 1 refused"


def test_a_licence_that_is_not_allowed_is_refused(
    dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made.write_twin(dataset / "own", twin_id="feedfeedfeedfeed", source={"license": "unknown"})
    status, _, refused = said(capsys, dataset, out=tmp_path / "out", license_allow="cc-by-4.0,CC0-1.0")
    assert status == 3
    assert refused.startswith("feedfeedfeedfeed: its licence is unknown") and len(refused.splitlines()) == 1
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [made.NAME, "mug_01234567"]
    assert said(capsys, dataset, out=tmp_path / "out", license_allow="CC-BY-4.0,unknown")[0] == 0


def test_two_twins_of_one_name_do_not_overwrite_each_other(
    dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made.write_twin(dataset / "other", twin_id=made.TWIN_ID[:8] + "ffffffff")
    status, told, refused = said(capsys, dataset, out=tmp_path / "out")
    assert status == 3 and f"has the same name {made.NAME}; export it" in refused
    assert "2 twins exported" in told


def test_a_twin_that_cannot_be_read_does_not_stop_the_others(
    dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (dataset / "broken").mkdir()
    (dataset / "broken" / "twin.json").write_text("{")
    status, told, refused = said(capsys, dataset, out=tmp_path / "out")
    assert status == 3 and "its JSON is broken" in refused and "2 twins exported" in told


@pytest.mark.parametrize(
    ("twin", "options", "message"),
    [
        ("set", {"to": "urdf,stl"}, "unknown format 'stl'"),
        ("set", {"to": ""}, "no format is named"),
        ("set", {"license_allow": " ,"}, "names no licence"),
        ("nowhere", {}, "no twin.json in it or below it"),
    ],
)
def test_wrong_use_is_said(
    twin: str, options: dict[str, Any], message: str, dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    given = {"to": "urdf", "license_allow": None, "out": "out", **options}
    with pytest.raises(UsageError, match=message):
        export([twin], **{**given, "out": Path(given["out"])})
    assert not (tmp_path / "out").exists()
