"""Closer look: a denser set of places around each functional point, on its part, marked in a close-up picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, create_model

from manitwin.formats.image_file import png_of
from manitwin.geometry.frames.feature import FramedMesh
from manitwin.geometry.frames.nearby_samples import REACH_SHARE, find_nearby_samples
from manitwin.geometry.parts.part_rules import membership
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import farthest_point_sampling
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.protocol import CloserPlace, PointsRequest
from manitwin.models.annotators.vlm.place_checks import PlaceChecks
from manitwin.models.annotators.vlm.prompt_files import Prompt
from manitwin.models.annotators.vlm.question_parts import extents_of, name_line, size_line
from manitwin.models.vlm.protocol import Picture, Question
from manitwin.models.vlm.strict_schema import strict_schema
from manitwin.render.background_colors import background_for, marker_color
from manitwin.render.cameras import Camera, look_at, project
from manitwin.render.markers import draw_markers, font_px
from manitwin.render.raycast import merge_parts, silhouette, visibility_tolerance_m, visible_points
from manitwin.render.renderer import BACKDROP, shared_renderer
from manitwin.twin.point_records import FunctionalPoint

PLACES = 12
"""Number of places marked around a point, including the point itself."""
LEAST_PLACES = 4
"""Minimum number of visible places; a point with fewer is not asked about, because there is nothing to choose."""
LETTERS = "ABCD"
_SHOWN = 1.6  # half width of the picture, as a multiple of the reach
_STREAM = 3


class CloserChoice(BaseModel):
    """The best place for one point: reason before number."""

    model_config = ConfigDict(frozen=True)

    rationale: str = Field(description="where on the part the place is and why it is the best of them")
    id: str = Field(description="the marker's number")


@dataclass(frozen=True)
class PlaceSet:
    """A point with its set of places: positions and normals ``(K, 3)``, marker numbers ``(K,)``, and its camera and letter."""

    point: FunctionalPoint
    letter: str
    camera: Camera
    positions_m: np.ndarray
    normals: np.ndarray
    numbers: np.ndarray

    def place(self, number: str) -> CloserPlace:
        """Return the place with a marker number."""
        index = int(np.flatnonzero(self.numbers == int(number))[0])
        return CloserPlace(self.positions_m[index], self.normals[index])


def nearby_places(checks: PlaceChecks, points: Sequence[FunctionalPoint], side_px: int) -> list[PlaceSet]:
    """Return the points that can be refined, each with its set of places: its own and eleven around it.

    The places are surface samples visible from the camera within 15 % of the longest side, on the same side of the object and
    on the same part if the shape determines parts, chosen by farthest point sampling. The camera is at the position of the
    view that sees the point most directly, and looks at the point.
    """
    request = checks.request
    surface = FramedMesh(merge_parts(list(request.subject.parts)), request.center_of_mass_m, request.subject.seed)
    found = list[PlaceSet]()
    for letter, point in zip(LETTERS, points, strict=False):
        camera = _camera(request, point, REACH_SHARE * surface.size_m, side_px)
        if camera is None:
            continue
        near = _same_part_samples(checks, point, surface)
        positions = np.concatenate([[point.position_m], surface.samples[0][near]])
        normals = np.concatenate([[point.normal], surface.samples[1][near]])
        seen = visible_points(positions, normals, camera, surface.caster, visibility_tolerance_m(surface.mesh.extents))
        if not seen[0] or seen.sum() < LEAST_PLACES:
            continue
        chosen = np.flatnonzero(seen)[
            farthest_point_sampling(positions[seen], PLACES, 0)
        ]  # starts with the point's own place
        rng = np.random.default_rng([request.subject.seed, _STREAM, LETTERS.index(letter)])
        numbers = rng.permutation(len(chosen)) + 1
        found.append(PlaceSet(point, letter, camera, positions[chosen], normals[chosen], numbers))
    return found


def _camera(request: PointsRequest, point: FunctionalPoint, reach_m: float, side_px: int) -> Camera | None:
    """Return the camera that looks at a point from nearby, None if no view shows the point."""
    at, outward = np.array(point.position_m), np.array(point.normal)
    pairs = zip(request.subject.cameras, request.visible, strict=True)
    eyes = [camera.position for camera, seen in pairs if point.candidate in seen]
    if not eyes:
        return None
    eye = max(eyes, key=lambda place: float(outward @ (place - at)) / float(np.linalg.norm(place - at)))
    tangent = _SHOWN * reach_m / float(np.linalg.norm(eye - at))
    return Camera(look_at(eye, at), 2 * float(np.arctan(tangent)), side_px, side_px)


def _same_part_samples(checks: PlaceChecks, point: FunctionalPoint, surface: FramedMesh) -> np.ndarray:
    """Return the indices of the samples around a point on the same part; all of them if the shape determines no parts."""
    subject, at = checks.request.subject, np.array(point.position_m)
    near = find_nearby_samples(surface, at, np.array(point.normal))
    prior = find_prior(subject.name or subject.known_as)
    if prior is None or prior.parts is None:
        return near
    found = membership(prior.parts, checks.shape, np.concatenate([at[None], surface.samples[0][near]]))
    return near if found is None else near[found.index[1:] == found.index[0]]


def closer_answer(nearby: Sequence[PlaceSet]) -> type[BaseModel]:
    """Return the model class of an answer: for each point's letter one of the numbers in its picture."""
    return _answer({each.letter: [str(number) for number in sorted(each.numbers)] for each in nearby})


def _answer(ids: dict[str, list[str]]) -> type[BaseModel]:
    fields: dict[str, Any] = {}
    for letter, numbers in ids.items():
        # ids are strings, as in the points questions; a JSON number is accepted for the same id
        one_of = Annotated[Literal[tuple(numbers)], BeforeValidator(str)]  # type: ignore[valid-type]
        number: Any = (one_of, Field(description="the marker's number"))
        choice = create_model(f"CloserChoice{letter}", __base__=CloserChoice, id=number)
        fields[letter] = (choice, ...)
    return create_model("CloserAnswer", __config__=ConfigDict(frozen=True), **fields)


CLOSER_FORM = _answer({letter: ["1"] for letter in LETTERS})
"""Form of an answer independent of the object."""


@dataclass(frozen=True)
class NearbyPictures:
    """Close-up pictures ``(H, W, 3) uint8`` of points, without and with numbered markers, and the name of the markers' colour."""

    clean: list[np.ndarray]
    marked: list[np.ndarray]
    marker: str


def nearby_pictures(request: PointsRequest, nearby: Sequence[PlaceSet]) -> NearbyPictures:
    """Draw the places around each point; raises RendererMissing without a renderer."""
    parts = list(request.subject.parts)
    frames = shared_renderer().render(parts, [each.camera for each in nearby])
    ground = background_for(frames)
    pictures = [frame.composited_over(BACKDROP, ground) for frame in frames]
    color, surface = marker_color(pictures), RayCaster(merge_parts(parts))
    marked = [
        draw_markers(
            clean,
            project(each.positions_m, each.camera)[0],
            [str(number) for number in each.numbers],
            occupied=silhouette(surface, each.camera),
            dot=color.rgb,
            font_px=font_px(each.camera.width_px, each.camera.height_px),
        )
        for each, clean in zip(nearby, pictures, strict=True)
    ]
    return NearbyPictures(pictures, marked, color.name)


def closer_question(
    request: PointsRequest, nearby: Sequence[PlaceSet], pictures: NearbyPictures, prompt: Prompt
) -> Question:
    """Ask for the best place of each point."""
    subject = request.subject
    shown: list[str | Picture] = []
    for each, clean, marked in zip(nearby, pictures.clean, pictures.marked, strict=True):
        words = f"Point {each.letter}, {each.point.label!r} ({each.point.description})"
        shown += [f"{words}, from nearby, clean:", Picture(png_of(clean))]
        shown += [f"Point {each.letter}, with markers:", Picture(png_of(marked))]
    values = {
        "name": name_line(subject.name, subject.known_as),
        "size": size_line(subject, extents_of(subject.parts)),
        "marker": pictures.marker,
        "letters": ", ".join(each.letter for each in nearby),
    }
    instructions, asked = prompt.filled(values, shown)
    return Question("closer_look", instructions, asked, strict_schema(closer_answer(nearby)))


def chosen_places(answer: BaseModel, nearby: Sequence[PlaceSet]) -> dict[str, CloserPlace]:
    """Return the chosen place of each point that is to be moved, by the point's id."""
    chosen = {each.point.id: each.place(getattr(answer, each.letter).id) for each in nearby}
    own = {each.point.id: each.point.position_m for each in nearby}
    return {name: place for name, place in chosen.items() if not np.array_equal(place.position_m, own[name])}
