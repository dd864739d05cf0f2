"""An asset whose reader hangs, swells or crashes is that asset's finding or refusal, and the others go on."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from manitwin.assets import within_limits
from manitwin.assets.audit import run
from manitwin.assets.audit.run import audit_assets
from manitwin.assets.importers.importer import import_assets
from manitwin.formats import isolated
from manitwin.formats.isolated import Limits

READER = """
import os, sys, types

def read(path, root, limits, joints="part"):
    text = open(path).read()
    if "hang" in text:
        while True:
            pass
    if "swell" in text:
        bytearray(1 << 40)
    if "abort" in text:
        os.abort()
    from manitwin.errors import AssetError
    raise AssetError(f"{path}: an ordinary refusal")

reader = types.ModuleType("manitwin.assets.readers.sdf")
reader.read = read
sys.modules[reader.__name__] = reader
"""
"""Found by every interpreter that is started with the folder in its path, before anything else."""
SAID = {"abort": "process which read it ended", "swell": "GiB of memory|more memory", "zebra": "an ordinary refusal"}
HANGS = {"hang": "takes longer than 3 s"}


@pytest.fixture(params=["ends", "hangs"])
def assets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> Iterator[tuple[Path, dict[str, str]]]:
    """A folder of assets and what is said of each; only where one hangs is the limit of time one that is reached."""
    said, seconds = (SAID, 600.0) if request.param == "ends" else (HANGS, 3.0)
    (tmp_path / "path").mkdir()
    (tmp_path / "path/sitecustomize.py").write_text(READER)
    monkeypatch.syspath_prepend(tmp_path / "path")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "path"), prepend=":")
    limits = Limits(seconds=seconds, memory_bytes=8 << 30)
    monkeypatch.setattr(within_limits, "LIMITS", limits)
    monkeypatch.setattr(run, "LIMITS", limits)
    folder = tmp_path / "assets"
    folder.mkdir()
    for name in said:
        (folder / f"{name}.sdf").write_text(f"<sdf version='1.7'><visual/><!-- {name} --></sdf>")
    end_processes()
    yield folder, said
    end_processes()


def end_processes() -> None:
    """End the processes that know another set of readers."""
    for number in list(isolated._workers):
        isolated._workers.pop(number).end()


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_an_asset_that_hangs_swells_or_crashes_is_a_finding_of_its_own(
    assets: tuple[Path, dict[str, str]], jobs: int
) -> None:
    folder, expected = assets
    audited = audit_assets([folder], jobs=jobs)
    assert [Path(each.asset).stem for each in audited] == list(expected)
    for each, said in zip(audited, expected.values(), strict=True):
        (finding,) = each.findings
        assert finding.code == "FIL001" and "\n" not in finding.message
        assert re.search(said, finding.message), finding.message


def test_an_asset_that_hangs_swells_or_crashes_is_not_imported_and_the_others_are(
    assets: tuple[Path, dict[str, str]], tmp_path: Path
) -> None:
    folder, expected = assets
    imported = list(import_assets([folder], tmp_path / "out"))
    assert all(each.record is None for each in imported)
    for each, said in zip(imported, expected.values(), strict=True):
        assert each.error is not None and re.search(said, each.error), each.error
