"""STEP: solids of CAD programs in metres and in their own axes, and broken ones in one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manitwin.errors import InputError
from manitwin.formats.meshes import step
from manitwin.formats.meshes.read import read_mesh
from manitwin.formats.sniff import sniff
from step_document import step_box


@pytest.mark.parametrize(("unit", "metres"), [("mm", 0.001), ("m", 1.0), ("inch", 0.0254)])
def test_a_step_solid_is_in_metres_whatever_its_unit(tmp_path: Path, unit: str, metres: float) -> None:
    (tmp_path / "box.step").write_text(step_box((10, 20, 30), unit))
    read = read_mesh(tmp_path / "box.step")
    assert (read.format, read.unit_m, read.up, read.findings) == ("step", 1.0, None, [])
    bounds = np.array([part.bounds for part in read.parts])
    assert np.allclose(bounds[:, 0].min(0), 0) and np.allclose(bounds[:, 1].max(0), np.array([10, 20, 30]) * metres)
    assert sum(part.volume for part in read.parts) == pytest.approx(6000 * metres**3, rel=1e-5)


def test_it_is_told_by_what_it_holds(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text(step_box((1, 1, 1)))
    assert sniff(tmp_path / "a.txt").format == "step"
    assert read_mesh(tmp_path / "a.txt").findings == ["the file is named .txt and holds step; it was read as that"]


@pytest.mark.parametrize(
    "text", [step_box((1, 2, 3))[:1500], "ISO-10303-21;\n", step_box((1, 2, 3)).replace("BREP", "BRIP")]
)
def test_a_broken_or_empty_file_is_one_clear_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.stp").write_text(text)
    with pytest.raises(InputError) as caught:
        read_mesh(tmp_path / "a.stp")
    assert caught.value.reason in ("unreadable", "no_faces")
    assert "\n" not in str(caught.value) and "a.stp: " in str(caught.value)


def test_what_reads_cad_files_is_named_where_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.stp").write_text(step_box((1, 2, 3)))
    monkeypatch.setattr(step, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"the STEP reader is not installed; pip install 'manitwin\[cad\]', or export"):
        read_mesh(tmp_path / "a.stp")
