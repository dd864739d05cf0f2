"""Templates fitted to pictures that are drawn of templates with other measures, seen from known views."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from scipy import ndimage

from kept_solids import kept_solids
from manitwin.errors import Rejected
from manitwin.formats.glb import read_glb
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.generators.lift import LiftGenerator
from manitwin.models.generators.lift.lifting import hint_from_name, lift
from manitwin.models.generators.lift.multi_view_generation import generate_from_views
from manitwin.models.generators.lift.photo_generation import fit_or_lift, generate_from_photo
from manitwin.models.generators.lift.unnamed_shape import TEMPLATE_SOURCE
from manitwin.models.generators.protocol import Generated, GenerationRequest, PhotoView
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.drawing import edges_between, silhouette, to_pixels, visible_faces
from manitwin.models.generators.templates.fitting.fit import (
    LEAST_CONFIDENCE,
    MOST_OUTLINE,
    alternative_categories,
    confidence_of,
    fit,
    template_for,
)
from manitwin.models.generators.templates.fitting.generated import texture_fit
from manitwin.models.generators.templates.fitting.joint_fit import fit_several
from manitwin.models.generators.templates.fitting.view import View, frame_placement, normalised

SIDE_PX = 480
LETTERS = (250, 40, 40)


def photo_of(category: str, view: View, measures: dict[str, float], *, letters: bool = False) -> np.ndarray:
    """Draw a template, lit from the upper left, on transparent magenta ``(H, W, 4)``; letters on its front are red bars."""
    template = load_templates()[category]
    mesh = template.build(**template.typical_measures() | measures).assembly.mesh()
    points, _, _ = normalised(mesh.vertices)
    scale, x, y = frame_placement(view.project(points)[0])
    flat, distance = View(**vars(view) | {"scale": scale, "x": x, "y": y}).project(points)
    face = visible_faces(to_pixels(flat, SIDE_PX, 0.7), distance, mesh.faces, SIDE_PX)
    solid = trimesh.Trimesh(points, mesh.faces, process=False)
    normals = solid.face_normals @ view.object_to_camera.T
    light = 0.45 + 0.5 * np.clip(normals @ np.array([-0.4, 0.6, 0.69]), 0, 1)
    rgba = np.zeros((SIDE_PX, SIDE_PX, 4), np.uint8)
    rgba[...] = (255, 0, 255, 0)
    shown = face >= 0
    tone = np.array([[210, 190, 90], [90, 140, 200], [120, 180, 120], [200, 200, 200]])[mesh.part % 4]
    rgba[shown, :3] = (tone * light[:, None])[face[shown]]
    rgba[shown, 3] = 255
    if letters:
        row, column = (int(places.mean()) for places in np.nonzero(shown))
        for k in range(-2, 3):
            top = row + 12 * k
            cv2.rectangle(rgba, (column - 30, top), (column + 30, top + 4), (*LETTERS, 255), -1)
        rgba[~shown] = (255, 0, 255, 0)
    return rgba


@pytest.mark.parametrize(
    ("category", "view", "measures"),
    [
        ("colander", View(0.5, 0.5, 0.0, 0.2), {"height": 0.52}),
        pytest.param("grater", View(0.2, 0.9, 0.0, 0.2), {"taper": 0.75, "width": 0.5}, marks=pytest.mark.slow),
    ],
)
def test_small_holes_need_not_be_where_the_template_makes_them(
    category: str, view: View, measures: dict[str, float]
) -> None:
    found = fit(category, photo_of(category, view, measures))
    assert found is not None and found.confidence > 0.95
    assert (
        found.residual.iou > 0.97 and found.residual.outline < 0.003
    )  # with holes compared: 0.95 or less, 0.0067 or more
    assert "holes" in found.made.mesh.names
    assert abs(found.view.elevation_rad - view.elevation_rad) < 0.1


def test_silhouette_is_that_of_every_layer_together() -> None:
    mesh = load_templates()["mug"].build(**load_templates()["mug"].typical_measures()).assembly.mesh()
    points, _, _ = normalised(mesh.vertices)
    flat, distance = View(0.7, 0.5, 0.1, 0.2, scale=0.5).project(points)
    pixels = to_pixels(flat, 200, 0.8)
    drawn = silhouette(pixels, mesh.faces, edges_between(mesh.faces), 200)
    painted = visible_faces(pixels, distance, mesh.faces, 200) >= 0  # fills each pixel that a face touches
    assert 0 <= painted.sum() - drawn.sum() < 0.6 * cv2.arcLength(_outer(painted), True)
    assert not (drawn > painted).any()


def _outer(mask: np.ndarray) -> np.ndarray:
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    return np.asarray(np.concatenate(contours))


def test_mug_seen_from_above_gets_its_proportions_hollow_and_handle() -> None:
    measures = {"width": 0.96, "taper": 0.9, "handle": 0.37}
    rgba = photo_of("mug", View(0.6, np.radians(35), 0.03, 0.22), measures)
    fitted = fit("mug", rgba)
    assert fitted is not None and fitted.confidence > 0.9
    assert np.degrees(fitted.view.elevation_rad) == pytest.approx(35, abs=4)
    assert fitted.made.measures["width"] == pytest.approx(0.96, rel=0.04)
    assert fitted.made.measures["handle"] == pytest.approx(0.37, rel=0.08)
    solid = trimesh.Trimesh(fitted.made.mesh.vertices, fitted.made.mesh.faces)
    assert solid.volume < 0.35 * solid.convex_hull.volume
    assert {"handle", "inside", "rim"} <= set(fitted.made.mesh.names)


def test_box_seen_at_a_corner_gets_its_three_sides() -> None:
    rgba = photo_of("box", View(0.6, np.radians(30), 0.0, 0.25), {"width": 0.9, "depth": 0.5})
    fitted = fit("box", rgba)
    assert fitted is not None and fitted.confidence > 0.9
    sides = np.sort(np.ptp(fitted.made.mesh.vertices, axis=0))
    assert sides[:2] / sides[2] == pytest.approx([0.5, 0.9], rel=0.06)


def test_several_photos_share_their_measures_and_have_views_of_their_own() -> None:
    measures, elevations = {"width": 0.85, "depth": 0.55}, (8, 40)
    photos = [
        photo_of("box", View(0.5 + turn, np.radians(elevation), 0.0, 0.2), measures)
        for turn, elevation in enumerate(elevations)
    ]
    turn = np.degrees(-1.0) % 360  # the camera goes round the other way than the box turns
    found = fit_several("box", photos, turns_deg=[0.0, turn])
    assert found is not None and found.confidence > 0.9
    fits = found.fits
    assert len(fits) == 2 and fits[0].made is fits[1].made
    assert found.turns_deg == pytest.approx([0.0, turn], abs=4)
    for fitted, elevation in zip(fits, elevations, strict=True):
        assert np.degrees(fitted.view.elevation_rad) == pytest.approx(elevation, abs=3)
    sides = np.sort(np.ptp(fits[0].made.mesh.vertices, axis=0))
    assert sides[:2] / sides[2] == pytest.approx([0.55, 0.85], rel=0.04)
    # a second photo shows a side, and the lid, that the first does not
    both, alone = texture_fit(fits, photos), texture_fit(fits[:1], photos[:1])
    assert both.unseen_share < alone.unseen_share - 0.1


@pytest.mark.slow  # three searches
def test_turns_that_the_photos_contradict_are_refused_by_the_photo() -> None:
    photos = [photo_of("mug", View(-0.7 - turn, 0.3, 0.0, 0.2), {}) for turn in (0.0, np.pi / 2)]
    named = [PhotoView(f"{turn}.png", rgba, turn) for turn, rgba in zip((0.0, 200.0), photos, strict=True)]
    with pytest.raises(Rejected, match=r"200\.0\.png shows the mug from \d+ degrees, not 200"):
        generate_from_views(named, "mug")
    right = [PhotoView(view.name, view.rgba, turn) for view, turn in zip(named, (0.0, 90.0), strict=True)]
    made = generate_from_views(right, "mug")
    assert made.notes["primitive"] == "template:mug" and made.known is not None
    assert [view["turn_deg"] for view in made.notes["views"]] == pytest.approx([0, 90], abs=8)


def test_bottle_that_leans_in_the_photo_stands_on_its_base() -> None:
    rgba = photo_of("bottle", View(0.0, np.radians(10), np.radians(50), 0.15), {"width": 0.33})
    fitted = fit("bottle", rgba)
    assert fitted is not None and fitted.confidence > 0.9 and not fitted.upright
    low, high = fitted.made.mesh.vertices.min(axis=0), fitted.made.mesh.vertices.max(axis=0)
    assert low[2] == pytest.approx(0, abs=1e-6)
    assert (high - low)[0] / (high - low)[2] == pytest.approx(0.33, rel=0.06)


@pytest.mark.parametrize(("shown", "said"), [("spoon", "mug"), pytest.param("bottle", "bowl", marks=pytest.mark.slow)])
def test_photo_of_another_thing_is_no_confident_fit(shown: str, said: str) -> None:
    fitted = fit(said, photo_of(shown, View(0.4, np.radians(30), 0.0, 0.2), {}))
    assert fitted is not None and fitted.confidence < 0.5 * LEAST_CONFIDENCE


def test_wrong_name_of_a_container_is_rejected_with_what_was_measured() -> None:
    rgba = photo_of("fork", View(0.4, np.radians(60), 0.0, 0.2), {})
    with pytest.raises(Rejected, match=r"no mug that the template makes has this outline: overlap 0\.\d\d") as caught:
        LiftGenerator().submit(GenerationRequest(rgba, None, "coffee mug", seed=0))
    assert caught.value.reason == "generator_failed" and caught.value.stage == "generate"


def test_names_of_templates_and_of_priors_find_a_template() -> None:
    for name, category in (("Coffee_mug", "mug"), ("soda can", "drink can"), ("pliers", "pliers")):
        template = template_for(name)
        assert template is not None and template.category == category
    assert template_for(None) is None and template_for("unicorn") is None
    assert "drink can" in alternative_categories("can") and "watering can" not in alternative_categories("can")
    assert not {"food container", "matchbox"} & set(alternative_categories("box")), "a box has no clips, and no drawer"
    assert {"mug", "cup and saucer"} <= set(alternative_categories("cup")) and "cup" not in alternative_categories(
        "mug"
    )
    assert "mallet" in alternative_categories("hammer"), "the priors have it beside the hammer"
    assert "mallet" in alternative_categories("hammer", "small hammer") and "mallet" not in alternative_categories(
        "hammer", "my claw hammer"
    )
    assert "cap" in alternative_categories("hat", "red hats") and "cap" not in alternative_categories("hat", "sun hat")
    assert "tissue box" in alternative_categories("box", "small brown box")
    for told in ("box of pencils", "spark_plug_box", "a light bulb box"):
        assert alternative_categories("box", told) == [], "it keeps no tissues"
    assert {"ketchup bottle", "detergent bottle", "spray bottle"} <= set(alternative_categories("bottle"))
    told_in_full = {category for category, template in load_templates().items() if template.told_in_full}
    assert "perfume bottle" in told_in_full, "a brown bottle was one"
    assert not told_in_full & {kind for category in load_templates() for kind in alternative_categories(category)}


def test_texture_has_neither_background_nor_mirrored_letters() -> None:
    rgba = photo_of("can", View(0.0, np.radians(12), 0.0, 0.15), {"width": 0.7}, letters=True)
    fitted = fit("can", rgba)
    assert fitted is not None
    surface = texture_fit([fitted], [rgba])
    height, width = surface.texture.shape[:2]
    middle = surface.uv.mean(axis=1)
    at = np.column_stack([(1 - middle[:, 1]) * height, middle[:, 0] * width]).astype(int)
    colours = surface.texture[at[:, 0], at[:, 1]].astype(int)
    assert not (np.abs(colours - [255, 0, 255]).sum(axis=1) < 150).any()
    red = np.abs(colours - LETTERS).sum(axis=1) < 120
    assert red[surface.seen].any() and not red[~surface.seen].any()
    assert 0.4 < surface.unseen_share < 0.9


@pytest.fixture(scope="module")
def generated_mug(tmp_path_factory: pytest.TempPathFactory) -> tuple[np.ndarray, Generated]:
    """A photo of a mug, and what the generator makes of it."""
    rgba = photo_of("mug", View(0.6, np.radians(25), 0.0, 0.2), {})
    return rgba, _generated(rgba, "coffee mug", tmp_path_factory.mktemp("mug"))


def test_generator_gives_a_closed_solid_and_the_points_that_it_knows(
    generated_mug: tuple[np.ndarray, Generated],
) -> None:
    _, made = generated_mug
    assert made.notes["primitive"] == "template:mug" and made.notes["source"] == "template fitted to the photo"
    assert made.rests and not made.metric and made.known is not None and made.known.mass_kg is None
    assert made.known.source == "template:mug, fitted to the photo"
    (part,) = read_glb(made.path)
    solid = trimesh.Trimesh(part.vertices, part.faces, process=True, merge_tex=True, merge_norm=True)
    assert solid.is_watertight and solid.volume > 0
    handle = next(point for point in made.known.functional_points if point.label == "handle")
    away, _ = RayCaster(solid).first_hits(
        np.array([handle.position_m]) + 0.05 * np.array([handle.normal]), -np.array([handle.normal])
    )
    assert away[0] == pytest.approx(0.05, abs=0.002)


def test_same_photo_gives_the_same_bytes(generated_mug: tuple[np.ndarray, Generated], tmp_path: Path) -> None:
    rgba, made = generated_mug
    assert _generated(rgba, "coffee mug", tmp_path).path.read_bytes() == made.path.read_bytes()


@pytest.mark.parametrize(
    ("radius_px", "primitive"), [pytest.param(48, "template:hammer", marks=pytest.mark.slow), (80, "inflation")]
)
def test_doubtful_template_is_taken_before_an_inflation_and_a_wrong_one_is_not(
    radius_px: int, primitive: str, tmp_path: Path
) -> None:
    rgba = photo_of("hammer", View(0.5, np.radians(80), 0.0, 0.2), {})
    row, column = (int(places.mean()) for places in np.nonzero(rgba[..., 3]))
    cv2.circle(rgba, (column, row), radius_px, (120, 150, 120, 255), -1)  # no hammer has such a disc on its handle
    made = _generated(rgba, "hammer", tmp_path)
    assert made.notes["primitive"] == primitive
    fitted = made.notes if primitive.startswith("template") else made.notes["poor_fit"]
    assert fitted["confidence"] < LEAST_CONFIDENCE and fitted["residual"]["outline"] > 0.009


@pytest.mark.slow
def test_body_with_loops_beside_it_is_no_can(tmp_path: Path) -> None:
    rgba = photo_of("can", View(0.0, np.radians(12), 0.0, 0.15), {})
    rows, columns = np.nonzero(rgba[..., 3])
    for side in (columns.min(), columns.max()):
        cv2.ellipse(rgba, (int(side), int(rows.mean())), (40, 60), 0, 0, 360, (120, 150, 120, 255), 14)
    notes = lift(rgba, hint_from_name("can")).notes
    assert notes["primitive"] == "revolution" and notes["handles"] == 2
    with pytest.raises(Rejected, match="something sticks out beside the body, which no can has"):
        _generated(rgba, "can", tmp_path)


def test_outline_of_a_box_is_no_round_thing_where_the_name_says_that_it_is_not_round() -> None:
    rgba = photo_of("basket", View(0.0, np.radians(8), 0.0, 0.15), {})
    rgba[..., 3] = np.where(ndimage.binary_fill_holes(rgba[..., 3] > 127), 255, 0)
    assert lift(rgba, hint_from_name("basket")).notes["primitive"] == "revolution"  # explains the outline as well
    fitted = fit("box", rgba)  # what it is called is what is asked, and a box is fitted sooner
    assert fitted is not None
    residual = replace(fitted.residual, outline=3 * MOST_OUTLINE)
    doubtful = replace(fitted, category="basket", residual=residual, confidence=confidence_of(residual))
    with pytest.raises(Rejected, match="a basket is not round"):
        fit_or_lift(doubtful, rgba, "basket")
    assert fit_or_lift(None, rgba, "basket").notes["primitive"] == "revolution"


@pytest.mark.parametrize(
    ("name", "category"),
    [
        ("pink storage tray", "serving tray"), ("storage tray", "serving tray"), ("red ceramic mug", "mug"), ("a", None),
        ("Bravo apple juice", "milk carton"), ("chapstick", "glue stick"), ("comic book", "book"),
        ("whipping cream", "milk carton"), ("Arla sour cream", "yogurt cup"), ("ink bottle", "ink bottle"), ("nectarine", None),
    ],
)  # fmt: skip
def test_template_is_that_of_the_last_words_of_a_name(name: str, category: str | None) -> None:
    template = template_for(name)
    assert (None if template is None else template.category) == category


def _generated(rgba: np.ndarray, name: str, folder: Path) -> Generated:
    generator = LiftGenerator()
    return generator.fetch(generator.submit(GenerationRequest(rgba, None, name, seed=0)), folder)


@pytest.fixture(scope="module")
def nameless_mug() -> Iterator[np.ndarray]:
    """A photo of a mug that nobody names."""
    with kept_solids():
        yield photo_of("mug", View(np.radians(60.0), np.radians(30.0), 0.0, 0.1), {})


def test_a_nameless_thing_has_the_shape_of_a_likely_name_that_explains_the_photo(nameless_mug: np.ndarray) -> None:
    likely = (("wrench", 0.5), ("mug", 0.2), ("bowl", 0.05))
    job = generate_from_photo(nameless_mug, None, likely=likely)
    assert job.notes["primitive"] == "shape of template:mug" and job.notes["source"] == TEMPLATE_SOURCE
    assert job.known is None and "category" not in job.notes, "it is not called so"
    assert job.notes["rests"] == "standing"


def test_a_nameless_thing_that_no_likely_name_explains_is_lifted(nameless_mug: np.ndarray) -> None:
    lifted = generate_from_photo(nameless_mug, None)
    assert not lifted.notes["primitive"].startswith("shape of"), "without names it is lifted"
    unlike, unlikely = (("wrench", 0.9), ("plunger", 0.1)), (("mug", 0.09),)
    assert generate_from_photo(nameless_mug, None, likely=unlike).glb == lifted.glb
    assert generate_from_photo(nameless_mug, None, likely=unlikely).glb == lifted.glb


@pytest.mark.slow
def test_a_nameless_ellipse_is_what_explains_it_better_than_any_ellipse_is() -> None:
    pan = photo_of("frying pan", View(np.radians(-90.0), np.radians(35.0), 0.0, 0.1), {})
    seen = generate_from_photo(pan, None, likely=(("frying pan", 0.9),))
    assert seen.notes["primitive"] == "shape of template:frying pan"
    plate = photo_of("plate", View(0.4, np.radians(55.0), 0.0, 0.2), {})
    with pytest.raises(Rejected, match="the outline is an ellipse"):
        generate_from_photo(plate, None, likely=(("frying pan", 0.4),))
    assert (
        generate_from_photo(plate, None, likely=(("frying pan", 0.4), ("plate", 0.3))).notes["primitive"]
        == "shape of template:plate"
    )


def test_a_cup_with_a_lip_and_a_question_mark_for_an_ear_gets_both() -> None:
    measures = {"flare": 0.13, "join": 0.22, "hook": 1.0, "bottom": 0.5}
    fitted = fit("tea cup", photo_of("tea cup", View(0.35, np.radians(14), 0.0, 0.2), measures))
    assert fitted is not None and fitted.confidence > 0.98 and fitted.residual.outline < 0.0025
    found = fitted.made.measures
    assert found["flare"] > 0.08 and found["join"] == pytest.approx(0.22, abs=0.05) and found["hook"] > 0.7


@pytest.mark.slow
def test_kind_that_comes_nearest_is_searched_by_itself_where_it_is_not_believed() -> None:
    # a little bent, as no template makes it: from the few views of other kinds the saucer is found, and not the ear
    measures = {
        "saucer": 0.14,
        "cup": 0.535,
        "belly": 0.889,
        "bottom": 0.313,
        "taper": 0.70,
        "join": 0.277,
        "hook": 1.09,
    }
    straight = photo_of(
        "cup and saucer", View(-0.014, np.radians(7.5), 0.0, 0.43), measures | {"rim": 0.896, "handle": 0.384}
    )
    y, x = np.mgrid[:SIDE_PX, :SIDE_PX].astype(np.float32)
    bent_x = x + 0.006 * SIDE_PX * np.sin(6.0 * y / SIDE_PX + 1.5)
    bent_y = y + 0.006 * SIDE_PX * np.sin(5.0 * x / SIDE_PX + 3.0)
    photo = cv2.remap(straight, bent_x.astype(np.float32), bent_y.astype(np.float32), cv2.INTER_NEAREST)
    found = fit("cup", photo, or_of=alternative_categories("cup"))
    assert found is not None and found.category == "cup and saucer" and found.confidence >= LEAST_CONFIDENCE
    assert found.residual.outline < 0.25 * MOST_OUTLINE
