from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from trimesh.visual.material import PBRMaterial

from manitwin.config import MeshConfig
from manitwin.engine.stage import Draft
from manitwin.errors import InputError, Rejected
from manitwin.formats.glb import read_glb, write_glb
from manitwin.formats.meshes.shading_normals import with_creased_normals
from manitwin.formats.meshes.textures import make_part
from manitwin.geometry.cavity import find_opening
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import ObjectDescription
from manitwin.models.generators.templates.ground_truth import object_import_record
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.pipeline.item import Item
from manitwin.pipeline.mesh import MeshStage
from manitwin.twin.import_record import FITTED, GivenPoint

GREY = PBRMaterial(baseColorFactor=[160, 160, 160, 255], metallicFactor=0.0, roughnessFactor=0.6)


def _run(path: Path, folder: Path, **item: Any) -> tuple[dict[str, Any], trimesh.Trimesh, list[trimesh.Trimesh]]:
    folder.mkdir(exist_ok=True)
    fields = MeshStage(MeshConfig()).run(Draft("id", Item(str(path), **item), 0), folder)
    arrays = np.load(folder / "canonical.npz")
    solid = trimesh.Trimesh(arrays["vertices"], arrays["faces"], process=False)
    return fields["geometry"], solid, read_glb(folder / "canonical.glb")


def _check(geometry: dict[str, Any], solid: trimesh.Trimesh, parts: list[trimesh.Trimesh]) -> None:
    json.dumps(geometry, allow_nan=False)
    points = np.vstack([part.vertices for part in parts])
    np.testing.assert_allclose([points.min(0), points.max(0)], solid.bounds, atol=1e-4)
    np.testing.assert_allclose(solid.bounds[0][:2], -solid.bounds[1][:2], atol=1e-9)
    assert solid.bounds[0][2] == pytest.approx(0, abs=1e-12)
    assert geometry["watertight"] and solid.is_watertight and solid.is_winding_consistent and solid.volume > 0
    assert (geometry["vertices"], geometry["faces"]) == (len(solid.vertices), len(solid.faces))


@pytest.mark.parametrize(("given", "who"), [(None, "the user"), ("import.json", "the import")])
def test_the_reason_names_who_said_which_axis_is_up(tmp_path: Path, given: str | None, who: str) -> None:
    box = trimesh.creation.box((0.1, 0.06, 0.04))
    box.export(tmp_path / "box.glb")
    geometry, _, _ = _run(tmp_path / "box.glb", tmp_path / "out", up="y", units="m", given=given)
    assert geometry["up_reason"] == f"y is up as {who} says"


def test_of_a_generated_mesh_the_generator_says_which_axis_is_up(tmp_path: Path) -> None:
    trimesh.creation.box((0.1, 0.06, 0.04)).export(tmp_path / "generated.glb")
    fields = {"generation": {"rests": True, "metric": True}}
    draft = Draft("id", Item(None, text="a box"), 0, fields, {"generated.glb": tmp_path / "generated.glb"})
    geometry = MeshStage(MeshConfig()).run(draft, tmp_path)["geometry"]
    assert geometry["up_reason"] == "y is up as the generator says"


def test_closed_parts_that_touch_stay_bodies_of_their_own(tmp_path: Path) -> None:
    """Their vertices are split at creases: welded to each other, walls of a box would share edges of four faces."""
    walls = {  # an open box: middle and sides
        "floor": ((0.0, 0.0, 0.003), (0.16, 0.1, 0.006)),
        "right": ((0.077, 0.0, 0.043), (0.006, 0.1, 0.074)),
        "left": ((-0.077, 0.0, 0.043), (0.006, 0.1, 0.074)),
        "back": ((0.0, 0.047, 0.043), (0.148, 0.006, 0.074)),
        "front": ((0.0, -0.047, 0.043), (0.148, 0.006, 0.074)),
    }
    parts = []
    for name, (middle, sides) in walls.items():
        box = trimesh.creation.box(sides, transform=trimesh.transformations.translation_matrix(middle))
        parts.append(with_creased_normals(make_part(box.vertices, box.faces, material=GREY, name=name)))
    (tmp_path / "box.glb").write_bytes(write_glb(parts))
    geometry, solid, _ = _run(tmp_path / "box.glb", tmp_path / "out")
    assert geometry["components"] == 5 and geometry["watertight"] and len(solid.faces) == 60


def test_a_game_asset_whose_numbers_are_no_lengths_has_no_scale(tmp_path: Path) -> None:
    trimesh.creation.cylinder(radius=0.18, height=0.89).export(tmp_path / "bottle.glb")
    declared, _, _ = _run(tmp_path / "bottle.glb", tmp_path / "declared", name="bottle")
    none, _, _ = _run(tmp_path / "bottle.glb", tmp_path / "none", name="bottle", units="none")
    assert (declared["metric"], declared["units"]) == (True, "declared")
    assert (none["metric"], none["units"], none["unit_factor"]) == (False, "user", 1.0)
    assert not any("units" in finding for finding in none["findings"])


def test_a_stated_longest_side_is_the_size_of_what_has_none(tmp_path: Path) -> None:
    """A generator's mesh in a unit of its own, and with it what the generator knows of it."""
    trimesh.creation.box((2.0, 1.2, 0.8)).export(tmp_path / "generated.glb")
    made = make_object(load_templates()["book"], ObjectDescription("book", {}), np.random.default_rng(0))
    known = object_import_record(made, "book").model_copy(
        update={"functional_points": [GivenPoint(position_m=(1.0, 0.0, 0.8))], "format": FITTED}
    )
    fields = {"generation": {"rests": True, "metric": False, "known": known.model_dump(mode="json")}}
    draft = Draft(
        "id", Item("photo.jpg", longest_side_m=0.24), 0, fields, {"generated.glb": tmp_path / "generated.glb"}
    )
    geometry = MeshStage(MeshConfig()).run(draft, tmp_path)["geometry"]
    assert (geometry["metric"], geometry["units"]) == (True, "user")
    with np.load(tmp_path / "canonical.npz") as arrays:
        assert np.ptp(arrays["vertices"], axis=0).max() == pytest.approx(0.24)
    (part,) = read_glb(tmp_path / "canonical.glb")
    assert part.extents.max() == pytest.approx(0.24, rel=1e-5)
    (point,) = geometry["known"]["functional_points"]
    assert point["position_m"][0] == pytest.approx(0.12)


def test_an_stl_without_a_word_is_in_millimetres(tmp_path: Path) -> None:
    trimesh.creation.box((60.0, 32.0, 32.0)).export(tmp_path / "queen.stl")
    geometry, solid, _ = _run(tmp_path / "queen.stl", tmp_path / "out")
    assert (geometry["metric"], geometry["units"], geometry["unit_factor"]) == (True, "guessed", 0.001)
    assert solid.extents.max() == pytest.approx(0.06)
    assert geometry["findings"] == ["60 units are 60 m as metres, which is implausible; read as millimetres: 0.06 m"]


def test_a_hat_of_a_file_lies_on_its_rim(tmp_path: Path) -> None:
    bowl = trimesh.boolean.difference(
        [trimesh.creation.icosphere(3, 0.1), trimesh.creation.icosphere(3, 0.095), _half_space()], engine="manifold"
    )
    bowl.export(tmp_path / "hat.stl")
    for name, opens in (("hat", -1.0), ("bowl", 1.0)):
        _, solid, _ = _run(tmp_path / "hat.stl", tmp_path / name, name=name)
        opening = find_opening(solid)
        assert opening is not None and opening.axis[2] == pytest.approx(opens, abs=1e-3)


@pytest.mark.parametrize(("name", "height_m"), [("alarm clock", 0.11), ("camera", 0.11), ("mobile phone", 0.05)])
def test_what_often_stands_does_so_where_its_file_has_it_so(tmp_path: Path, name: str, height_m: float) -> None:
    """A flat, round body on a broad foot: it lies more likely than it stands."""
    body = trimesh.creation.cylinder(0.05, 0.04, sections=48).apply_transform(
        trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0))
    )
    foot = trimesh.creation.box((0.07, 0.05, 0.02), trimesh.transformations.translation_matrix((0, 0, -0.05)))
    trimesh.boolean.union([body, foot], engine="manifold").export(tmp_path / "clock.stl")
    _, solid, _ = _run(tmp_path / "clock.stl", tmp_path / "out", name=name, units="m")
    assert solid.extents[2] == pytest.approx(height_m, abs=2e-3)


@pytest.mark.parametrize(("name", "height_m"), [("shelf", 0.2), ("open container", 0.15)])
def test_a_shelf_is_open_in_front_and_a_container_above(tmp_path: Path, name: str, height_m: float) -> None:
    outside = trimesh.creation.box((0.3, 0.15, 0.2))
    inside = trimesh.creation.box((0.28, 0.15, 0.18), trimesh.transformations.translation_matrix((0, 0.01, 0)))
    trimesh.boolean.difference([outside, inside], engine="manifold").export(tmp_path / "shelf.stl")
    _, solid, _ = _run(tmp_path / "shelf.stl", tmp_path / "out", name=name, units="m")
    assert solid.extents[2] == pytest.approx(height_m, abs=1e-3)


def _half_space() -> trimesh.Trimesh:
    return trimesh.creation.box((1, 1, 1)).apply_translation((0, 0, -0.5))


@pytest.mark.shared_data
def test_mug_of_the_shared_data_stands_with_its_volume_of_134_ml(shared_data: Path, tmp_path: Path) -> None:
    geometry, solid, parts = _run(shared_data / "meshes/mug_ycb/white_mug.obj", tmp_path, name="mug")
    _check(geometry, solid, parts)
    assert solid.volume == pytest.approx(134e-6, abs=1e-6)
    opening = find_opening(solid)
    assert opening is not None and opening.axis[2] > 0.999
    assert (geometry["metric"], geometry["units"], geometry["up"], geometry["euler_number"]) == (
        True,
        "assumed",
        "z",
        0,
    )


@pytest.mark.shared_data
def test_y_up_gltf_bowl_opens_upward(shared_data: Path, tmp_path: Path) -> None:
    geometry, solid, parts = _run(shared_data / "meshes/bowl_evo/evo_bowl.gltf", tmp_path)
    _check(geometry, solid, parts)
    np.testing.assert_allclose(solid.extents, [0.1468, 0.1469, 0.0613], atol=1e-4)
    assert (geometry["units"], geometry["up"]) == ("declared", "y")


@pytest.mark.shared_data
def test_millimetres_are_noticed_and_said(shared_data: Path, tmp_path: Path) -> None:
    geometry, solid, parts = _run(shared_data / "bad/millimetres.obj", tmp_path)
    _check(geometry, solid, parts)
    assert solid.extents.max() == pytest.approx(0.2401, abs=3e-4)
    assert geometry["unit_factor"] == 0.001
    assert any("millimetres" in finding for finding in geometry["findings"])


@pytest.mark.shared_data
def test_unit_given_by_the_user_is_used_without_a_finding(shared_data: Path, tmp_path: Path) -> None:
    geometry, solid, _ = _run(shared_data / "bad/millimetres.obj", tmp_path, units="mm")
    assert solid.extents.max() == pytest.approx(0.2401, abs=3e-4)
    assert (geometry["metric"], geometry["units"], geometry["findings"]) == (True, "user", [])


@pytest.mark.shared_data
def test_damaged_dinosaur_is_repaired_to_the_volume_of_the_sound_one(shared_data: Path, tmp_path: Path) -> None:
    geometry, solid, parts = _run(shared_data / "bad/nonmanifold.obj", tmp_path, name="toy dinosaur")
    _check(geometry, solid, parts)
    sound = trimesh.load_mesh(
        shared_data / "meshes/toy_dinosaur/dinosaur_figure.obj", process=True, merge_norm=True, merge_tex=True
    )
    assert solid.volume == pytest.approx(sound.volume, rel=0.03)
    assert len(geometry["repairs"]) >= 3


@pytest.mark.shared_data
def test_box_without_texture_has_its_size(shared_data: Path, tmp_path: Path) -> None:
    geometry, solid, parts = _run(shared_data / "bad/missing_texture.obj", tmp_path)
    _check(geometry, solid, parts)
    np.testing.assert_allclose(np.sort(solid.extents), [0.02, 0.06, 0.09], atol=1e-9)
    assert solid.volume == pytest.approx(0.02 * 0.06 * 0.09)
    assert any("gone.mtl" in finding for finding in geometry["findings"])


@pytest.mark.shared_data
def test_scene_of_four_objects_is_read_whole(shared_data: Path, tmp_path: Path) -> None:
    geometry, solid, parts = _run(shared_data / "bad/scene_four_objects.glb", tmp_path)
    assert geometry["components"] == len(parts) == 4
    points = np.vstack([part.vertices for part in parts])
    np.testing.assert_allclose([points.min(0), points.max(0)], solid.bounds, atol=1e-4)


@pytest.mark.shared_data
@pytest.mark.parametrize(("name", "reason"), [("nan_vertices.obj", "not_finite"), ("zero_faces.obj", "no_faces")])
def test_hopeless_inputs_are_refused(shared_data: Path, tmp_path: Path, name: str, reason: str) -> None:
    with pytest.raises(InputError) as caught:
        _run(shared_data / "bad" / name, tmp_path)
    assert (caught.value.stage, caught.value.reason) == ("input", reason)


DEGENERATE = {
    "tiny": [(1e-300, 1e-300, 1e-300), 0.0],
    "almost flat": [(0.04, 0.05, 1e-300), 0.0],
    "denormal": [(0.04, 0.05, 4e-320), 0.0],
    "far away": [(0.04, 0.05, 0.1), 5e11],
    "a point": [(0.0, 0.0, 0.0), 1.0],
    "a line": [(0.04, 0.0, 0.0), 0.0],
    "a needle": [(9e11, 1e-9, 1e-300), 0.0],
}


@pytest.mark.parametrize("how", DEGENERATE)
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_surface_without_extent_is_degenerate_in_one_line(tmp_path: Path, how: str) -> None:
    size, place = DEGENERATE[how]
    box = trimesh.creation.box((1, 1, 1))
    rows = "".join("v {!r} {!r} {!r}\n".format(*(np.array(v) * size + place).tolist()) for v in box.vertices)
    faces = "".join("f {} {} {}\n".format(*(face + 1)) for face in box.faces)
    (tmp_path / "a.obj").write_text(rows + faces)
    with pytest.raises(Rejected) as caught:
        _run(tmp_path / "a.obj", tmp_path, units="m")
    assert (caught.value.stage, caught.value.reason) == ("gate", "degenerate")
    assert caught.value.detail.startswith("a.obj: ") and caught.value.detail.isprintable()


@pytest.mark.shared_data
def test_same_input_gives_the_same_bytes(shared_data: Path, tmp_path: Path) -> None:
    for name in ("one", "two"):
        _run(shared_data / "meshes/sponge/textured.dae", tmp_path / name, name="sponge")
    for artifact in ("canonical.glb", "canonical.npz"):
        assert (tmp_path / "one" / artifact).read_bytes() == (tmp_path / "two" / artifact).read_bytes()


@pytest.mark.shared_data
def test_generated_mesh_is_metric_only_where_its_generator_says_so(shared_data: Path, tmp_path: Path) -> None:
    path = shared_data / "meshes/salt_shaker/salt_shaker.glb"
    for metric in (False, True):
        draft = Draft(
            "id", Item(str(tmp_path / "photo.jpg")), 0, {"generation": {"metric": metric}}, {"generated.glb": path}
        )
        assert MeshStage(MeshConfig()).run(draft, tmp_path)["geometry"]["metric"] is metric


@pytest.mark.shared_data
@pytest.mark.slow
@pytest.mark.parametrize("named", [True, False])
def test_all_shared_meshes_rest_as_a_person_would_put_them_down(shared_data: Path, tmp_path: Path, named: bool) -> None:
    """Heights in metres, checked by eye on pictures: upright for what stands, flat for what lies."""
    heights = {
        "mug_ycb": 0.0807, "bowl_evo": 0.0613, "plate_8in": 0.0178, "mustard_bottle": 0.1913, "fuze_bottle": 0.2151,
        "tomato_soup_can": 0.1018, "cracker_box": 0.2134, "gelatin_box": 0.030, "banana": 0.0363, "fork": 0.0156,
        "spoon": 0.0219, "phillips_screwdriver": 0.0355, "scissors": 0.0154, "large_clamp": 0.0378,
        "large_marker": 0.0188, "frypan_8in": 0.0479, "headset": 0.0964, "can_opener": 0.0633, "utensil_holder": 0.1736,
        "mallet": 0.0605 if named else 0.0962, "spatula": 0.0249, "toy_dinosaur": 0.1332, "sneaker": 0.1593,
        "sponge": 0.036, "salt_shaker": 0.125,
    }  # fmt: skip
    openings = {"mug_ycb", "bowl_evo", "plate_8in", "frypan_8in", "utensil_holder", "sneaker"}
    with (shared_data / "manifest.csv").open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["kind"] == "mesh"]
    for row in rows:
        key = row["file"].split("/")[1]
        geometry, solid, parts = _run(shared_data / row["file"], tmp_path, name=row["category"] if named else None)
        _check(geometry, solid, parts)
        assert solid.extents[2] == pytest.approx(heights[key], abs=6e-4), key
        opening = find_opening(solid)
        assert (opening is not None and opening.axis[2] > 0.99) == (key in openings), key
