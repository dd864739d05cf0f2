"""The stage that tells parts: by a template's construction, by form, or not at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from handmade import cup, mug, visual
from manitwin.engine.stage import Draft
from manitwin.formats.glb import read_glb, write_glb
from manitwin.geometry.parts.part_rules import membership
from manitwin.geometry.parts.shape import measure_shape
from manitwin.models.annotators.part_names import part_name
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.priors import load_priors
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.ground_truth import object_import_record
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.models.generators.templates.template_object import visual_parts
from manitwin.pipeline.item import Item
from manitwin.pipeline.parts import PARTS_FILE, PartsStage

NO_POINTS: dict[str, list[object]] = {"functional": [], "grasp": []}


def draft_of(folder: Path, mesh: trimesh.Trimesh, parts: list[trimesh.Trimesh], name: str, known: object) -> Draft:
    (folder / "visual.glb").write_bytes(write_glb(parts))
    np.savez(folder / "solid.npz", vertices=mesh.vertices, faces=mesh.faces)
    fields = {
        "physical": {"center_of_mass_m": mesh.center_mass.tolist()},
        "points": NO_POINTS,
        "language": {"category": "object"},
        "geometry": {"known": known},
    }
    paths = {key: folder / key for key in ("visual.glb", "solid.npz")}
    return Draft("id", Item(file=None, name=name), 0, fields, paths)


@pytest.mark.parametrize("category", ["hammer", "teapot", "book"])
def test_parts_of_a_template_are_those_it_was_built_of(tmp_path: Path, category: str) -> None:
    templates = load_templates()
    made = make_object(templates[category], read_text(category, templates), np.random.default_rng(0))
    solid = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
    known = object_import_record(made, category).model_dump(mode="json")
    draft = draft_of(tmp_path, solid, visual_parts(made), category, known)
    table = PartsStage().run(draft, tmp_path)["parts"]
    with np.load(tmp_path / PARTS_FILE) as arrays:
        of_visual, of_solid = arrays["visual"], arrays["solid"]
    names = [part["name"] for part in table]
    assert set(names) == {made.mesh.names[i] for i in np.unique(made.mesh.part)}
    assert {part["source"] for part in table} == {f"template:{category}"}
    assert [names[i] for i in of_solid] == [made.mesh.names[i] for i in made.mesh.part]
    assert np.bincount(of_visual).tolist() == [part["faces"] for part in table]
    shown = read_glb(tmp_path / "visual.glb")
    centers = np.concatenate([part.triangles_center for part in shown])
    areas = np.concatenate([part.area_faces for part in shown])
    for place, part in enumerate(table):
        mine = of_visual == place
        assert np.allclose(part["centroid_m"], np.average(centers[mine], axis=0, weights=areas[mine]), atol=1e-6)
        true = solid.area_faces[made.mesh.part == made.mesh.names.index(part["name"])].sum() / solid.area
        assert part["area_share"] == pytest.approx(true, abs=1e-4)


def parts_of_mug(folder: Path, name: str, point: dict[str, object] | None = None) -> dict[str, float]:
    mesh = mug()
    draft = draft_of(folder, mesh, [visual(mesh, baseColorFactor=[200, 10, 10, 255])], name, None)
    if point is not None:
        draft.fields["points"] = NO_POINTS | {"grasp": [point]}
    return {part["name"]: part["area_share"] for part in PartsStage().run(draft, folder)["parts"]}


def test_parts_of_a_mesh_are_told_by_its_form(tmp_path: Path) -> None:
    shares = parts_of_mug(tmp_path, "mug")
    assert set(shares) == {"body", "handle"} and shares["handle"] < 0.3
    with np.load(tmp_path / PARTS_FILE) as arrays:
        assert set(arrays["visual"].tolist()) == set(arrays["solid"].tolist()) == {0, 1}


def test_part_is_called_what_a_point_on_it_is_called(tmp_path: Path) -> None:
    mesh = mug()
    outermost = mesh.triangles_center[mesh.triangles_center[:, 0].argmax()].tolist()
    assert set(parts_of_mug(tmp_path, "mug", {"position_m": outermost, "label": "Loop handle"})) == {
        "body",
        "loop handle",
    }
    assert set(parts_of_mug(tmp_path, "mug", {"position_m": outermost, "label": "far side"})) == {"body", "handle"}


@pytest.mark.parametrize(
    ("role", "category", "labels", "name"),
    [
        ("handle", "scissors", [], "handle"),  # its finger rings are a place on it
        ("head", "scissors", [], "blades"),
        ("head", "screwdriver", ["tip", "shaft"], "shaft"),
        ("neck", "spoon", [], "neck"),
        ("cap", "pump bottle", [], "nozzle"),
        ("grip", "drill", ["pistol grip"], "pistol grip"),
    ],
)
def test_name_is_that_of_the_whole_part(role: str, category: str, labels: list[str], name: str) -> None:
    prior = find_prior(category)
    assert prior is not None and part_name(role, prior, labels) == name


@pytest.mark.parametrize(
    ("category", "names"),
    [
        ("marker", {"shaft": "barrel", "tip": "cap"}),
        ("clamp", {"shaft": "spring joint", "tip": "jaws", "end": "handles"}),
        ("rolling pin", {"shaft": "roller", "tip": "handle", "end": "handle"}),
        ("wrench", {"shaft": "handle", "tip": "jaw", "end": "end"}),  # no label is of the ring alone
    ],
)
def test_sections_are_called_by_the_places_that_they_hold(category: str, names: dict[str, str]) -> None:
    prior = find_prior(category)
    assert prior is not None and prior.parts == "sectioned"
    assert {role: part_name(role, prior, [], names) for role in names} == names


@pytest.mark.parametrize("names", [{"shaft": "bow", "tip": "blade"}, {"shaft": "blade", "end": "bow"}])
def test_a_shaft_goes_on_to_the_end_that_is_not_told_from_it(names: dict[str, str]) -> None:
    """Of a thing that has two ends and no middle, as a key has; keys themselves are told apart by their widths."""
    prior = load_priors()["key"].model_copy(update={"parts": "sectioned"})
    assert {role: part_name(role, prior, [], names) for role in names} == names


def test_a_vessel_without_a_handle_has_an_inside_and_a_base(tmp_path: Path) -> None:
    mesh = cup()
    draft = draft_of(tmp_path, mesh, [visual(mesh, baseColorFactor=[200, 10, 10, 255])], "bowl", None)
    table = PartsStage().run(draft, tmp_path)["parts"]
    assert {part["name"] for part in table} >= {"body", "inside", "base"}
    assert {part["source"] for part in table} == {"geometry:open"}


@pytest.mark.parametrize("name", ["book", "box", "gizmo"])
def test_nothing_is_told_of_what_has_no_rule(tmp_path: Path, name: str) -> None:
    assert parts_of_mug(tmp_path, name) == {}
    with np.load(tmp_path / PARTS_FILE) as arrays:
        assert (arrays["visual"] == 255).all() and (arrays["solid"] == 255).all()


def test_faces_that_repair_has_changed_are_not_given_a_templates_parts(tmp_path: Path) -> None:
    mesh = mug()
    templates = load_templates()
    known = object_import_record(
        make_object(templates["mug"], read_text("mug", templates), np.random.default_rng(0)), "mug"
    )
    shown = [visual(mesh, baseColorFactor=[200, 10, 10, 255])]
    draft = draft_of(tmp_path, mesh, shown, "mug", known.model_dump(mode="json"))
    assert {part["source"] for part in PartsStage().run(draft, tmp_path)["parts"]} == {"geometry:handled"}


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_keys_bow_begins_where_it_widens(seed: int) -> None:
    """A round bow widens by degrees: no sharp step shows it, and a notch of the blade is one."""
    templates, prior = load_templates(), load_priors()["key"]
    made = make_object(templates["key"], read_text("key", templates), np.random.default_rng(seed))
    solid = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
    shape = measure_shape(solid, solid.center_mass, prior.head_end, False, np.random.default_rng(seed))
    assert prior.parts is not None
    told = membership(prior.parts, shape, shape.surface_m)
    assert told is not None
    shown = [told.roles[i] for i in np.unique(told.index)]
    assert [part_name(role, prior, (), shown) for role in shown] == ["blade", "bow"]
    border = shape.axis.along(shape.surface_m[told.index == told.roles.index("head")]).max()
    assert 0.45 < border < 0.75, "blades of keys are half to three quarters of their length"
