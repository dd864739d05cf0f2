"""The physical stage: scale, mass properties and plausibility, against closed forms."""

from __future__ import annotations

import json
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from handmade import cup, cylinder, visual
from manitwin.config import PhysicalConfig
from manitwin.engine.stage import Draft
from manitwin.errors import BadReply, Rejected
from manitwin.formats.glb import read_glb, write_glb
from manitwin.geometry.mass_properties import solid_mass_properties
from manitwin.geometry.poses import GLTF_TO_OBJECT
from manitwin.models.annotators.imported_annotations import ImportedAnnotator
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.protocol import PhysicalEstimates, Subject
from manitwin.models.annotators.rules import RulesAnnotator
from manitwin.pipeline.annotated_mass import annotated_mass
from manitwin.pipeline.item import Item
from manitwin.pipeline.object_state import load_solid
from manitwin.pipeline.physical import PhysicalStage
from manitwin.twin.import_record import ImportRecord
from manitwin.twin.record import Physical
from manitwin.twin.record_values import Estimate


class Says(RulesAnnotator):
    """The rules, with some answers replaced by those of a test."""

    def __init__(self, **answers: object):
        self._answers = answers

    def estimate_physical(self, subject: Subject) -> PhysicalEstimates:
        """Answer as the rules do, but for what the test says."""
        return replace(super().estimate_physical(subject), **self._answers)


def said(value: float, source: str = "vlm:test") -> Estimate:
    return Estimate(value=value, low=value / 2, high=value * 2, source=source)


def run(
    mesh: trimesh.Trimesh,
    folder: Path,
    name: str | None,
    metric: bool = True,
    annotator: RulesAnnotator | None = None,
    **geometry: str,
) -> Physical:
    (folder / "views").mkdir(exist_ok=True)
    part = visual(mesh, baseColorFactor=[200, 10, 10, 255])
    (folder / "canonical.glb").write_bytes(write_glb([part]))
    np.savez(folder / "canonical.npz", vertices=mesh.vertices, faces=mesh.faces)
    paths = {key: folder / key for key in ("canonical.glb", "canonical.npz", "views/")}
    draft = Draft(
        "id", Item(file=None, name=name), 0, {"geometry": {"metric": metric, **geometry}, "cameras": []}, paths
    )
    fields = PhysicalStage(PhysicalConfig(), annotator or RulesAnnotator()).run(draft, folder)
    json.dumps(fields, allow_nan=False)
    return Physical(**fields["physical"])


def test_a_cups_center_of_mass_and_inertia_are_those_of_its_walls(tmp_path: Path) -> None:
    physical = run(cup(0.04, 0.1, 0.003), tmp_path, "cup", annotator=Says(mass_kg=said(0.2)))
    # A tube and a floor disc: volume, height of the centre, and moments about it.
    outer, inner, height, floor = 0.04, 0.037, 0.1, 0.003
    tube, disc = np.pi * (outer**2 - inner**2) * (height - floor), np.pi * outer**2 * floor
    density = 0.2 / (tube + disc)
    center = (tube * (height + floor) / 2 + disc * floor / 2) / (tube + disc)
    about_axis = density * (tube * (outer**2 + inner**2) / 2 + disc * outer**2 / 2)
    assert physical.center_of_mass_m == pytest.approx([0, 0, center], abs=2e-4)
    assert physical.inertia_kg_m2[2][2] == pytest.approx(about_axis, rel=0.01)
    assert physical.density_kg_m3 == pytest.approx(density, rel=0.01)
    assert physical.mass_distribution == "solid" and physical.center_of_mass_uncertainty_m < 0.003


def test_a_metric_mesh_keeps_its_size_and_its_file(tmp_path: Path) -> None:
    physical = run(cup(), tmp_path, "cup")
    assert physical.scale_applied == 1.0
    assert physical.extents_m == pytest.approx([0.08, 0.08, 0.1], abs=1e-6)
    assert (tmp_path / "visual.glb").read_bytes() == (tmp_path / "canonical.glb").read_bytes()


def test_a_mesh_of_no_known_scale_gets_the_longest_axis_of_such_a_thing(tmp_path: Path) -> None:
    giant = cylinder(1.0, 3.0)
    physical = run(giant, tmp_path, "soda can", metric=False)
    longest = find_prior("soda can").longest_axis_m.typical
    assert physical.scale_applied == pytest.approx(longest / 3.0, rel=1e-6)
    assert max(physical.obb.extents_m) == pytest.approx(longest)
    assert np.array(physical.obb.obb_to_object)[:3, 3] == pytest.approx([0, 0, longest / 2], abs=1e-9)
    assert load_solid(tmp_path / "solid.npz").extents == pytest.approx(np.array([2, 2, 3]) * longest / 3)
    assert read_glb(tmp_path / "visual.glb")[0].extents == pytest.approx(np.array([2, 2, 3]) * longest / 3, rel=1e-5)
    assert find_prior("soda can").mass_kg.low <= physical.mass_kg.value <= find_prior("soda can").mass_kg.high


def test_a_hollow_ball_is_a_shell(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.033)
    ball.apply_translation([0, 0, 0.033])
    physical = run(ball, tmp_path, "tennis ball")
    assert physical.mass_distribution == "shell"
    # a thin sphere at the middle of its 3 mm wall: 2/3 m r^2
    assert physical.inertia_kg_m2[0][0] == pytest.approx(2 / 3 * physical.mass_kg.value * 0.0315**2, rel=0.02)
    assert physical.mass_kg.value == pytest.approx(0.058, rel=0.05)  # ITF: 56.0 to 59.4 g


def test_a_size_that_no_such_thing_has_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(Rejected, match=r"0\.9.* m long, but a mug has 0\.08 to 0\.16 m") as raised:
        run(cup(0.4, 0.9, 0.03), tmp_path, "mug")
    assert raised.value.reason == "implausible_size"


def test_what_is_usually_longer_than_any_hand_holds_is_rejected_where_nobody_says_its_scale(tmp_path: Path) -> None:
    said = r"1\.25 m is how long such a thing usually is, and no gripper here holds one longer than 1 m"
    with pytest.raises(Rejected, match=said) as raised:
        run(cylinder(0.1, 3.0), tmp_path, "broom", metric=False)
    assert raised.value.reason == "implausible_size"


def test_without_a_name_any_size_goes(tmp_path: Path) -> None:
    assert run(cup(0.4, 0.9, 0.03), tmp_path, None).mass_kg.source == "prior:unknown"


def test_a_mass_that_no_such_thing_has_is_rejected_unless_confirmed(tmp_path: Path) -> None:
    with pytest.raises(Rejected) as raised:
        run(cup(), tmp_path, "cup", annotator=Says(mass_kg=said(9.0)))
    assert raised.value.reason == "implausible_mass"
    assert run(cup(), tmp_path, "cup", annotator=Says(mass_kg=said(9.0, "measured"))).mass_kg.value == 9.0


def test_a_density_that_no_matter_has_is_rejected_without_a_name_too(tmp_path: Path) -> None:
    with pytest.raises(Rejected, match="kg/m3") as raised:
        run(cylinder(0.01, 0.02), tmp_path, None, annotator=Says(mass_kg=said(5.0)))
    assert raised.value.reason == "implausible_mass"


def test_a_rejection_of_a_mesh_whose_unit_was_guessed_says_how_it_was_read(tmp_path: Path) -> None:
    read_as = "1380 units are 13.8 m as declared, which is implausible; read as millimetres: 1.38 m"
    with pytest.raises(Rejected) as raised:
        run(cylinder(0.1, 1.38), tmp_path, "dumbbell", units="guessed", unit_finding=read_as)
    assert raised.value.reason == "implausible_size" and str(raised.value).endswith(read_as)


def test_mass_from_density_alone_is_density_times_volume(tmp_path: Path) -> None:
    mesh = cylinder(0.03, 0.1)
    physical = run(mesh, tmp_path, None, annotator=Says(mass_kg=None, bulk_density_kg_m3=said(500.0)))
    assert physical.mass_kg.source == "density*volume"
    assert physical.mass_kg.value == pytest.approx(500 * mesh.volume)


def test_an_answer_without_mass_or_density_is_no_answer(tmp_path: Path) -> None:
    with pytest.raises(BadReply, match="neither a mass nor a bulk density"):
        run(cup(), tmp_path, None, annotator=Says(mass_kg=None, bulk_density_kg_m3=None))


def hammer() -> trimesh.Trimesh:
    """A wooden handle of 28 cm that ends in the middle of a steel head, both boxes, lying on z = 0."""
    handle = trimesh.creation.box(
        [0.29, 0.025, 0.03], transform=trimesh.transformations.translation_matrix([-0.145, 0, 0.015])
    )
    head = trimesh.creation.box(
        [0.035, 0.11, 0.03], transform=trimesh.transformations.translation_matrix([0, 0, 0.015])
    )
    return trimesh.boolean.union([handle, head], engine="manifold")


def test_a_hammer_balances_at_its_steel_head(tmp_path: Path) -> None:
    mesh = hammer()
    physical = run(mesh, tmp_path, "hammer")
    wood, steel = 650 * 0.025 * 0.03 * 0.2725, 7850 * 0.035 * 0.11 * 0.03
    truth = wood * (-0.0175 - 0.2725 / 2) / (wood + steel)
    assert physical.mass_distribution == "parts"
    assert physical.center_of_mass_m[0] == pytest.approx(truth, abs=0.01)  # the border of the head, by form
    assert mesh.center_mass[0] < truth - 0.05
    assert physical.center_of_mass_uncertainty_m > 0.01
    moments = np.linalg.eigvalsh(physical.inertia_kg_m2)
    assert moments[0] > 0 and moments[2] <= moments[0] + moments[1]


def test_materials_of_which_one_part_has_none_are_not_guessed(tmp_path: Path) -> None:
    physical = run(hammer(), tmp_path, "hammer", annotator=Says(part_materials={"head": "steel"}))
    assert physical.mass_distribution == "solid"
    assert physical.center_of_mass_m == pytest.approx(hammer().center_mass, abs=1e-5)


def bottle() -> trimesh.Trimesh:
    return cylinder(0.035, 0.22)


def test_a_bottle_says_what_it_weighs_empty_half_full_and_full(tmp_path: Path) -> None:
    physical = run(bottle(), tmp_path, "water bottle")
    assert physical.filling is not None and "full water bottle" in physical.filling.assumption
    empty, half, full = physical.filling.states
    assert [each.share for each in physical.filling.states] == [0.0, 0.5, 1.0]
    prior = find_prior("water bottle")
    assert prior is not None and prior.bulk_density_kg_m3 is not None
    volume = physical.mass_kg.value / physical.density_kg_m3
    assert empty.mass_kg == pytest.approx(max(prior.bulk_density_kg_m3.low * volume, prior.mass_kg.low))
    assert physical.mass_kg.low <= empty.mass_kg * 1.0001
    assert half.mass_kg == pytest.approx((empty.mass_kg + full.mass_kg) / 2)
    assert full.mass_kg == pytest.approx(physical.mass_kg.value)
    assert full.center_of_mass_m == physical.center_of_mass_m and full.inertia_kg_m2 == physical.inertia_kg_m2
    contents = half.mass_kg - empty.mass_kg
    expected = (empty.mass_kg * empty.center_of_mass_m[2] + contents * 0.22 / 4) / half.mass_kg
    assert half.center_of_mass_m[2] == pytest.approx(expected, abs=5e-4)
    assert full.center_of_mass_uncertainty_m == physical.center_of_mass_uncertainty_m


@pytest.mark.parametrize("share", [0.0, 0.5])
@pytest.mark.parametrize("thick_m", [(0.0005, 0.0005), (0.0015, 0.0005), (0.0005, 0.0015)])
@pytest.mark.parametrize(
    "wall_factor", [pytest.param(0.6, marks=pytest.mark.slow), pytest.param(1.0, marks=pytest.mark.slow), 1.8]
)
def test_true_center_of_a_bottle_with_an_uneven_wall_is_within_its_states_uncertainty(
    tmp_path: Path, share: float, thick_m: tuple[float, float], wall_factor: float
) -> None:
    """The truth is the closed form of a tube with two ends of unlike thickness, and water to a level."""
    physical = run(bottle(), tmp_path, "water bottle")
    assert physical.filling is not None
    state = physical.filling.state_at(share)
    assert state is not None and state.center_of_mass_uncertainty_m is not None
    radius, height = 0.035, 0.22
    areas = np.array([2 * np.pi * radius * height * 0.0005, *(np.pi * radius**2 * each for each in thick_m)])
    wall_kg = wall_factor * physical.filling.states[0].mass_kg
    wall_m = float(areas @ [height / 2, 0.0, height] / areas.sum())
    water_kg = share * (physical.mass_kg.value - wall_kg)
    true_m = (wall_kg * wall_m + water_kg * share * height / 2) / (wall_kg + water_kg)
    off_m = abs(true_m - state.center_of_mass_m[2])
    assert off_m <= state.center_of_mass_uncertainty_m + 5e-4
    assert state.center_of_mass_uncertainty_m < 0.15 * height


def test_a_bottle_says_how_far_its_center_goes_between_empty_and_full(tmp_path: Path) -> None:
    physical = run(bottle(), tmp_path, "water bottle")
    assert physical.filling is not None
    empty_kg, full_kg = physical.filling.states[0].mass_kg, physical.mass_kg.value
    levels = np.linspace(0, 1, 201)
    water_kg = levels * (full_kg - empty_kg)
    centers_m = (empty_kg * 0.11 + water_kg * levels * 0.11) / (empty_kg + water_kg)
    assert physical.filling.center_of_mass_shift_m == pytest.approx(0.11 - centers_m.min(), abs=1e-3)


@pytest.mark.parametrize(
    ("name", "annotator"),
    [
        ("mug", Says()),  # open: its mesh has both walls
        ("battery", Says()),
        ("water bottle", Says(mass_kg=said(0.5, "measured"))),  # of one bottle, in a state that nobody told
        ("water bottle", Says(mass_kg=said(0.015))),  # of an empty one
        ("water bottle", Says(wall_thickness_m=0.0005)),  # said to be hollow
    ],
)
def test_no_fill_states_where_nothing_is_known_of_them(name: str, annotator: RulesAnnotator, tmp_path: Path) -> None:
    mesh = bottle() if name == "water bottle" else cylinder(0.007, 0.05) if name == "battery" else cup(0.04, 0.1, 0.003)
    assert run(mesh, tmp_path, name, annotator=annotator).filling is None


def annotated(mesh: trimesh.Trimesh, folder: Path, **fields: object) -> Path:
    """Write what another tool says of a mesh whose mass is 0.2 kg; return the import.json."""
    record = ImportRecord(
        format="urdf", file="x.urdf", name="block", category=None, license=None, attribution=None,
        asset_to_object=np.eye(4).tolist(), mass_kg=0.2, friction_static=None, friction_dynamic=None, restitution=None,
        material=None, captions=[], functional_points=[], grasp_points=[], grasps=[], rests=[], missing=[], remarks=[],
        **{"center_of_mass_m": None, "inertia_kg_m2": None, **fields},
    )  # fmt: skip
    path = folder / "import.json"
    path.write_text(record.model_dump_json())
    return path


def run_annotated(
    mesh: trimesh.Trimesh, folder: Path, given: Path, mass: Estimate | None = None, name: str | None = None
) -> dict[str, Any]:
    (folder / "views").mkdir(exist_ok=True)
    (folder / "canonical.glb").write_bytes(write_glb([visual(mesh, baseColorFactor=[200, 10, 10, 255])]))
    np.savez(folder / "canonical.npz", vertices=mesh.vertices, faces=mesh.faces)
    paths = {key: folder / key for key in ("canonical.glb", "canonical.npz", "views/")}
    geometry = {"metric": True, "input_to_object": GLTF_TO_OBJECT.tolist()}
    draft = Draft("id", Item(file=None, name=name, given=str(given)), 0, {"geometry": geometry, "cameras": []}, paths)
    annotator = ImportedAnnotator(Says(mass_kg=mass or said(0.2)))
    fields: dict[str, Any] = PhysicalStage(PhysicalConfig(), annotator).run(draft, folder)
    return fields


def test_an_annotated_center_and_inertia_are_kept(tmp_path: Path) -> None:
    mesh = cylinder(0.03, 0.1)
    inertia = np.array([[2e-4, 1e-5, 0], [1e-5, 2.2e-4, 0], [0, 0, 1.1e-4]])
    given = annotated(mesh, tmp_path, center_of_mass_m=[0.002, 0.0, 0.03], inertia_kg_m2=inertia.tolist())
    fields = run_annotated(mesh, tmp_path, given)
    physical = Physical(**fields["physical"])
    assert physical.mass_distribution == "annotated" and physical.center_of_mass_uncertainty_m == 0
    assert physical.center_of_mass_m == pytest.approx([0.002, 0.0, 0.03])
    assert np.allclose(physical.inertia_kg_m2, inertia, rtol=1e-9)
    assert not [finding for finding in fields["physical_findings"] if "moments" in finding]


@pytest.mark.parametrize(("kind", "accepted"), [("template", True), ("urdf", False)])
def test_a_template_weighs_what_its_parts_do(kind: str, accepted: bool, tmp_path: Path) -> None:
    """A plastic fork of 4 g is lighter than nearly every fork, and right; an asset that says so has mixed its units."""
    mesh = cylinder(0.003, 0.18)
    made = solid_mass_properties(mesh, 0.004)
    given = annotated(
        mesh, tmp_path, center_of_mass_m=made.center_of_mass_m.tolist(), inertia_kg_m2=made.inertia_kg_m2.tolist()
    )
    record = json.loads(given.read_text()) | {"format": kind, "category": "fork", "mass_kg": 0.004}
    given.write_text(json.dumps(record))
    if accepted:
        fields = run_annotated(mesh, tmp_path, given, said(0.04), "fork")
        assert fields["physical"]["mass_kg"]["value"] == 0.004
        assert any("mass 0.004 kg" in finding for finding in fields["physical_findings"]), "a finding says so"
        return
    with pytest.raises(Rejected, match="a fork weighs") as raised:
        run_annotated(mesh, tmp_path, given, said(0.04), "fork")
    assert raised.value.reason == "implausible_mass"


def test_an_inertia_far_from_the_shape_is_a_finding(tmp_path: Path) -> None:
    mesh = cylinder(0.03, 0.1)
    given = annotated(mesh, tmp_path, inertia_kg_m2=np.diag([0.2, 0.2, 0.2]).tolist())
    fields = run_annotated(mesh, tmp_path, given)
    assert any("principal moments 0.2, 0.2, 0.2" in finding for finding in fields["physical_findings"])


@pytest.mark.parametrize(
    ("fields", "cause"),
    [
        ({"inertia_kg_m2": np.diag([1e-4, 1e-4, 3e-4]).tolist()}, "physically impossible"),
        ({"inertia_kg_m2": np.diag([-1e-4, 1e-4, 1e-4]).tolist()}, "physically impossible"),
        ({"inertia_kg_m2": [[1e-4, 5e-5, 0], [0, 1e-4, 0], [0, 0, 1e-4]]}, "physically impossible"),
        ({"center_of_mass_m": [0.0, 0.05, 0.05]}, "20 mm outside"),
    ],
)
def test_what_no_body_has_rejects_an_import(tmp_path: Path, fields: dict[str, object], cause: str) -> None:
    mesh = cylinder(0.03, 0.1)
    with pytest.raises(Rejected, match=cause) as raised:
        run_annotated(mesh, tmp_path, annotated(mesh, tmp_path, **fields))
    assert raised.value.reason == "implausible_mass"


def test_annotated_mass_properties_scale_with_size_and_mass() -> None:
    solid = cylinder(0.06, 0.2)
    record = ImportRecord.model_validate_json(annotated_text(inertia_kg_m2=np.diag([2e-4, 2e-4, 1e-4]).tolist()))
    computed = solid_mass_properties(solid, 0.4)
    kept = annotated_mass(record, solid, mass_kg=0.4, scale=2.0, computed=computed)
    assert kept is not None
    assert np.allclose(kept.center_of_mass_m, [0, 0, 0.08])  # twice 0.04 m
    assert np.allclose(np.diag(kept.inertia_kg_m2), [1.6e-3, 1.6e-3, 8e-4])  # 2^2 times the double mass


def annotated_text(**fields: object) -> str:
    with tempfile.TemporaryDirectory() as folder:
        return annotated(cylinder(0.03, 0.1), Path(folder), center_of_mass_m=[0, 0, 0.04], **fields).read_text()


@pytest.mark.parametrize(("name", "one"), [("apple", "an apple"), ("scissors", "a pair of scissors")])
def test_a_rejection_names_the_thing_with_its_article(tmp_path: Path, name: str, one: str) -> None:
    with pytest.raises(Rejected, match=f"9 kg, but {one} weighs"):
        run(cylinder(0.04, 0.08), tmp_path, name, annotator=Says(mass_kg=said(9.0), longest_axis_m=None))
