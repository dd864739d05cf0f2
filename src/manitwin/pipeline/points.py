"""Selection of functional and grasp points among the candidates (paper, "VLM-Based Point Selection")."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from manitwin.config import NO_SETTINGS, Resource
from manitwin.engine.stage import Draft
from manitwin.errors import BadReply
from manitwin.geometry.distance import closest_points_on_triangles
from manitwin.geometry.frames.feature import FramedMesh
from manitwin.models.annotators.point_rules import spare_grasp_points
from manitwin.models.annotators.protocol import Annotator, LooksCloser, PointsRequest, SelectedPoints, Subject
from manitwin.pipeline.frames import with_frames
from manitwin.pipeline.human_corrections import corrected_points
from manitwin.pipeline.object_state import findings_of, pictures, read_scaled_subject
from manitwin.pipeline.refinement import marked_at, refined_points
from manitwin.pipeline.views import write_webp
from manitwin.render.raycast import merge_parts, visibility_tolerance_m
from manitwin.robots.grippers.gripper import Gripper
from manitwin.twin.point_records import FunctionalPoint, GraspPoint, RefinedCandidate

FUNCTIONAL, GRASP = (2, 4), (2, 3)
"""Least and largest number of points (paper: 2-4 functional and 2-3 grasp points)."""
WEBP_QUALITY = 90
"""Quality of the stored close-up images."""


class PointsStage:
    """Have the annotator select points among the candidates, and compute the frames of the functional points.

    An annotator with that ability looks at the functional points again in close-up; ``closer/`` contains the images it was
    shown. ``frames_missing`` gives the reason for each functional point without a frame, ``refined_candidates`` the marked
    positions of points that have moved since.
    """

    name: ClassVar[str] = "points"
    version: ClassVar[str] = "34"
    reads: ClassVar[tuple[str, ...]] = (
        "solid.npz", "visual.glb", "views/", "marked/", "physical", "size", "language", "candidates", "visible_candidates",
        "cameras", "geometry?", "naming?",
    )  # fmt: skip
    writes: ClassVar[tuple[str, ...]] = (
        "closer/", "points", "spare_grasp_points", "points_findings", "frames_missing", "refined_candidates",
    )  # fmt: skip

    settings = NO_SETTINGS

    def __init__(self, annotator: Annotator, gripper: Gripper):
        self._annotator = annotator
        self._gripper = gripper
        self.backend = annotator.name
        self.model = annotator.model_for("points")
        self.needs: Resource = annotator.needs
        self.expected_usd = annotator.expected_usd("points")

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Return ``points`` ``{functional, grasp}``. Raises BadReply for too few or too many points, or points that are not
        candidates.
        """
        candidates, physical = draft.field("candidates"), draft.field("physical")
        request = PointsRequest(
            subject=read_scaled_subject(draft, known_as=draft.field("language")["category"]),
            positions_m=np.array(candidates["positions_m"]),
            normals=np.array(candidates["normals"]),
            marked_views=pictures(draft.path("marked/"), "marked"),
            visible=tuple(tuple(ids) for ids in draft.field("visible_candidates")),
            center_of_mass_m=np.array(physical["center_of_mass_m"]),
            max_opening_m=self._gripper.opening_m,
        )
        amendment = draft.amendments.get(self.name, {})
        selected = corrected_points(self._annotator.select_points(request), request, amendment)
        check_selection(selected, request.positions_m)
        surface = FramedMesh(request.subject.solid, request.center_of_mass_m, draft.seed)
        spares = _spares(selected, request)
        taken = {point.candidate for point in (*selected.grasp, *spares)} | _human_candidates(selected.functional)
        looked, seen_nearby, shown = self._refine_points(selected.functional, request, taken)
        (folder / "closer").mkdir(parents=True, exist_ok=True)
        for point_id, picture in shown.items():
            write_webp(picture, folder / "closer" / f"closer_{point_id}.webp", WEBP_QUALITY)
        framed, missing = with_frames(looked, surface)
        functional, refined = refined_points(framed, surface, taken, _make_surface_test(request.subject))
        marked = {
            row.candidate: row for row in (*refined, *seen_nearby)
        }  # the position in the marked views, before the first move
        return {
            "points": {
                "functional": [point.model_dump() for point in functional],
                "grasp": [point.model_dump() for point in selected.grasp],
            },
            "spare_grasp_points": [point.model_dump() for point in spares],
            "points_findings": findings_of(selected),
            "frames_missing": missing,
            "refined_candidates": [marked[candidate].model_dump() for candidate in sorted(marked)],
        }

    def _refine_points(
        self, points: Sequence[FunctionalPoint], request: PointsRequest, kept: set[int]
    ) -> tuple[list[FunctionalPoint], list[RefinedCandidate], Mapping[str, np.ndarray]]:
        """Return the points as corrected by the annotator in close-up, their positions in the marked views, and its images."""
        if not isinstance(self._annotator, LooksCloser):
            return list(points), [], {}
        closer = self._annotator.look_closer(request, points)
        better = closer.places
        moved = [point for point in points if point.id in better and point.candidate not in kept]
        places = {point.id: better[point.id] for point in moved}
        looked = [
            point.model_copy(
                update={"position_m": places[point.id].position_m.tolist(), "normal": places[point.id].normal.tolist()}
            )
            if point.id in places
            else point
            for point in points
        ]
        return looked, [marked_at(point) for point in moved], closer.pictures


def _spares(selected: SelectedPoints, request: PointsRequest) -> list[GraspPoint]:
    """Return the next best grasp points, best first: the annotator's own, then geometric ones up to the number of points."""
    taken = [point.candidate for point in (*selected.grasp, *selected.spare)]
    missing = max(0, GRASP[1] - len(selected.spare))
    return [*selected.spare, *(spare_grasp_points(request, taken)[:missing] if missing else ())]


def _human_candidates(points: Iterable[FunctionalPoint]) -> set[int]:
    """Return the candidates at which a person has placed points, which are not moved."""
    return {point.candidate for point in points if point.source is not None}


def _make_surface_test(subject: Subject) -> Callable[[np.ndarray], bool]:
    """Return a function that tests whether a position ``(3,)`` lies on the visible surface, as candidates do."""
    limit_m, corners = visibility_tolerance_m(subject.solid.extents), merge_parts(list(subject.parts)).triangles

    def is_seen(place_m: np.ndarray) -> bool:
        nearest, _ = closest_points_on_triangles(np.repeat(place_m[None], len(corners), 0), corners)
        return bool(np.linalg.norm(nearest - place_m, axis=1).min() <= limit_m)

    return is_seen


def check_selection(selected: SelectedPoints, positions_m: np.ndarray) -> None:
    """Raise BadReply unless the points are 2-4 and 2-3 different candidates at their positions."""
    _check_kind("functional", selected.functional, FUNCTIONAL, positions_m)
    _check_kind("grasp", selected.grasp, GRASP, positions_m)


def _check_kind(
    kind: str,
    points: tuple[FunctionalPoint, ...] | tuple[GraspPoint, ...],
    limits: tuple[int, int],
    positions_m: np.ndarray,
) -> None:
    if not limits[0] <= len(points) <= limits[1]:
        raise BadReply(f"{len(points)} {kind} points, not {limits[0]} to {limits[1]}; ask the annotator again")
    numbers = [point.candidate for point in points]
    if len(set(numbers)) != len(numbers) or not all(0 <= i < len(positions_m) for i in numbers):
        raise BadReply(
            f"{kind} points at candidates {numbers}; they must differ and be below {len(positions_m)}; ask again"
        )
    for point in points:
        if not np.allclose(point.position_m, positions_m[point.candidate], atol=1e-6):
            raise BadReply(f"{kind} point {point.id} is not at its candidate {point.candidate}; ask again")
