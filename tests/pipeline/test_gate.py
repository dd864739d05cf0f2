import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from manitwin.config import GateConfig
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.textures import make_part, pbr_material
from manitwin.models.annotators.protocol import QualityVerdict, Subject
from manitwin.pipeline.gate import GateStage
from manitwin.pipeline.item import Item
from manitwin.twin.record import REJECTION_REASONS


class _Eye:
    """An annotator that only judges quality."""

    name, needs = "eye", "vlm"

    def __init__(self, verdict: QualityVerdict):
        self.verdict = verdict
        self.subject: Subject | None = None

    def model_for(self, question: str) -> str:
        return "v1"

    def expected_usd(self, question: str) -> float:
        return 0.0

    def judge_quality(self, subject: Subject) -> QualityVerdict:
        self.subject = subject
        return self.verdict


def _box(x: float = 0.0, side: float = 0.05) -> trimesh.Trimesh:
    return trimesh.creation.box((side, side, side)).apply_translation((x, 0, side / 2))


def _draft(folder: Path, mesh: trimesh.Trimesh, *, metric: bool = True, watertight: bool = True) -> Draft:
    np.savez(folder / "canonical.npz", vertices=np.array(mesh.vertices), faces=np.array(mesh.faces, dtype=np.int64))
    part = make_part(mesh.vertices, mesh.faces, material=pbr_material(name="grey"), name="box")
    (folder / "canonical.glb").write_bytes(write_glb([part], max_texture_size=64))
    (folder / "views").mkdir()
    for index in range(8):
        (folder / "views" / f"rgb_{index:02d}.webp").touch()
    geometry = {"metric": metric, "watertight": watertight, "repairs": ["closed 3 holes"]}
    paths = {name: folder / name for name in ("canonical.npz", "canonical.glb")} | {"views/": folder / "views"}
    return Draft("id", Item(file=None, name="box"), 0, {"geometry": geometry, "cameras": []}, paths)


def _gate(draft: Draft, folder: Path, annotator: _Eye | None = None) -> dict[str, dict]:
    checks = GateStage(GateConfig(), annotator).run(draft, folder)["gate"]["checks"]
    json.dumps(checks, allow_nan=False)
    return {check["name"]: check for check in checks}


def _rejection(draft: Draft, folder: Path, annotator: _Eye | None = None) -> Rejected:
    with pytest.raises(Rejected) as caught:
        GateStage(GateConfig(), annotator).run(draft, folder)
    assert caught.value.stage == "gate" and caught.value.reason in REJECTION_REASONS["gate"]
    return caught.value


def test_box_passes_and_what_no_eye_saw_is_not_passed(tmp_path: Path) -> None:
    checks = _gate(_draft(tmp_path, _box()), tmp_path)
    passed = {name: check["passed"] for name, check in checks.items()}
    assert passed == {
        "watertight": True, "positive_volume": True, "plausible_size": True, "single_object": True,
        "one_coherent_object": None, "visual_quality": None,
    }  # fmt: skip
    assert checks["visual_quality"]["message"].startswith("not judged")
    assert checks["positive_volume"]["value"] == pytest.approx(0.05 / 3)


def test_open_mesh_is_rejected_with_what_was_tried(tmp_path: Path) -> None:
    rejection = _rejection(_draft(tmp_path, _box(), watertight=False), tmp_path)
    assert rejection.reason == "not_watertight" and "closed 3 holes" in rejection.detail


@pytest.mark.parametrize("flat", [True, False])
def test_film_and_inside_out_solid_are_degenerate(tmp_path: Path, flat: bool) -> None:
    mesh = trimesh.creation.box((0.1, 0.1, 1e-6)) if flat else _box()
    if not flat:
        mesh.invert()
    assert _rejection(_draft(tmp_path, mesh), tmp_path).reason == "degenerate"


@pytest.mark.parametrize("far_m", [0.0, 0.06])
def test_a_solid_with_a_part_inside_out_is_degenerate_and_one_with_a_cavity_is_not(
    tmp_path: Path, far_m: float
) -> None:
    """A box within the other, inside out, is a cavity; beside it, it weighs less than nothing there."""
    hollow = trimesh.creation.box((0.03, 0.03, 0.03)).apply_translation((far_m, 0, 0.025))
    hollow.invert()
    draft = _draft(tmp_path, trimesh.util.concatenate([_box(), hollow]))
    if far_m == 0.0:
        assert _gate(draft, tmp_path)["positive_volume"]["passed"]
        return
    rejection = _rejection(draft, tmp_path)
    assert rejection.reason == "degenerate" and rejection.detail.startswith("parts of the solid are inside out")


def test_a_film_that_rounding_makes_negative_is_not_said_to_be_inside_out(tmp_path: Path) -> None:
    sheet = trimesh.Trimesh(
        [[0, 0, 1e-18], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 3], [1, 2, 3], [0, 3, 2], [0, 2, 1]]
    )
    wound = sheet if sheet.volume < 0 else trimesh.Trimesh(sheet.vertices, sheet.faces[:, ::-1], process=False)
    assert -1e-15 < wound.volume < 0
    assert "as thin as a film" in _rejection(_draft(tmp_path, wound), tmp_path).detail


@pytest.mark.parametrize("side_m", [0.004, 1.2])
def test_size_is_judged_only_where_it_is_known(tmp_path: Path, side_m: float) -> None:
    draft = _draft(tmp_path, _box(side=side_m))
    assert _rejection(draft, tmp_path).reason == "absurd_size"
    draft.fields["geometry"]["metric"] = False
    assert _gate(draft, tmp_path)["plausible_size"]["passed"] is None


@pytest.mark.parametrize(
    ("name", "side_m", "said"),
    [
        ("sofa", 2.4, "a sofa is that large, and no gripper here holds it"),
        ("sofa", 24.0, "give the right units (m, cm, mm), or the longest side in metres"),
        ("mug", 1.2, "give the right units (m, cm, mm), or the longest side in metres"),
        ("flux capacitor", 1.2, "an object that really is this large fits none of the shipped grippers"),
    ],
)
def test_what_is_as_large_as_such_things_are_is_told_so(tmp_path: Path, name: str, side_m: float, said: str) -> None:
    draft = _draft(tmp_path, _box(side=side_m))
    draft.payload = Item(file=None, name=name)
    rejection = _rejection(draft, tmp_path)
    assert rejection.reason == "absurd_size" and rejection.detail.endswith(said)


def test_of_an_imported_asset_the_unit_of_its_file_is_to_blame(tmp_path: Path) -> None:
    draft = _draft(tmp_path, _box(side=0.001))
    draft.payload = Item(file=None, given="import.json")
    said = "the file states this size: correct its unit and import it again, or give the longest side in metres"
    assert _rejection(draft, tmp_path).detail.endswith(said)


def test_four_things_side_by_side_are_rejected_with_their_number(tmp_path: Path) -> None:
    four = trimesh.util.concatenate([_box(0.08 * i) for i in range(4)])
    rejection = _rejection(_draft(tmp_path, four), tmp_path)
    assert rejection.reason == "several_objects" and rejection.detail.startswith("4 separate objects")


def test_specks_are_told_and_do_not_reject(tmp_path: Path) -> None:
    hollow = trimesh.creation.annulus(r_min=0.02, r_max=0.04, height=0.03)
    speck = _box(side=0.002).apply_translation((0.037, 0.037, 0.0))  # within the corner of its box
    checks = _gate(_draft(tmp_path, trimesh.util.concatenate([hollow, speck])), tmp_path)
    assert checks["single_object"]["passed"] and checks["single_object"]["message"] == "1 small parts float apart"


def test_small_parts_that_make_a_thing_longer_are_rejected(tmp_path: Path) -> None:
    tray = trimesh.creation.box((0.14, 0.04, 0.02))
    pegs = [_box(side=0.004).apply_translation((0.09, y, -0.008)) for y in (-0.01, 0.0, 0.01)]
    rejection = _rejection(_draft(tmp_path, trimesh.util.concatenate([tray, *pegs])), tmp_path)
    assert rejection.reason == "several_objects"
    assert rejection.detail.startswith(
        "3 small parts float apart from it, so that it is 0.162 m from end to end and not 0.14 m"
    )


def test_a_plate_of_pieces_each_of_which_is_small_is_several_objects(tmp_path: Path) -> None:
    pieces = [
        _box(0.03 * column, side=0.01).apply_translation((0, 0.03 * row, 0)) for column in range(5) for row in range(5)
    ]
    rejection = _rejection(_draft(tmp_path, trimesh.util.concatenate(pieces)), tmp_path)
    assert rejection.reason == "several_objects" and rejection.detail.startswith("25 separate objects")


def test_eye_sees_the_subject_and_its_no_rejects(tmp_path: Path) -> None:
    draft = _draft(tmp_path, _box())
    good = _Eye(QualityVerdict(True, True, "a clean box"))
    checks = _gate(draft, tmp_path, good)
    assert checks["visual_quality"]["passed"] and checks["one_coherent_object"]["passed"]
    assert good.subject is not None and len(good.subject.views) == 8 and len(good.subject.parts) == 1
    torn = _rejection(draft, tmp_path, _Eye(QualityVerdict(True, False, "torn texture")))
    assert torn.reason == "poor_quality" and "torn texture" in torn.detail
    assert _rejection(draft, tmp_path, _Eye(QualityVerdict(False, None, "two boxes"))).reason == "several_objects"


def test_backend_and_model_are_part_of_the_stage_key() -> None:
    stage = GateStage(GateConfig(), _Eye(QualityVerdict(None, None, "")))
    assert (stage.backend, stage.model) == ("eye", "v1")
    assert (GateStage(GateConfig()).backend, GateStage(GateConfig()).model) == ("geometry", None)
