"""The caption and points stages: what they hand to the annotator, and what they accept from it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from handmade import candidates, mug, visual
from manitwin.engine.stage import Draft
from manitwin.errors import BadReply
from manitwin.formats.glb import write_glb
from manitwin.models.annotators.protocol import CloserLook, CloserPlace, PointsRequest, SelectedPoints, Subject
from manitwin.models.annotators.rules import RulesAnnotator
from manitwin.pipeline.caption import CaptionStage
from manitwin.pipeline.item import Item
from manitwin.pipeline.points import PointsStage
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.twin.point_records import FunctionalPoint, GraspPoint
from manitwin.twin.record import Language

GRIPPER = ParallelGripper("test", "0", 0.08, 0.1, 50.0, 1.0, (0.01, 0.01), (), (), "a test")


@pytest.fixture
def draft(tmp_path: Path) -> Draft:
    mesh = mug()
    (tmp_path / "visual.glb").write_bytes(write_glb([visual(mesh, baseColorFactor=[200, 10, 10, 255])]))
    np.savez(tmp_path / "solid.npz", vertices=mesh.vertices, faces=mesh.faces)
    for folder in ("views", "marked"):
        (tmp_path / folder).mkdir()
    positions, normals = candidates(mesh)
    fields = {
        "physical": {
            "material": "ceramic",
            "scale_applied": 1.0,
            "extents_m": mesh.extents.tolist(),
            "center_of_mass_m": mesh.center_mass.tolist(),
        },
        "candidates": {"positions_m": positions.tolist(), "normals": normals.tolist()},
        "visible_candidates": [list(range(42))],
        "cameras": [],
    }
    paths = {key: tmp_path / key for key in ("visual.glb", "solid.npz", "views/", "marked/")}
    fields |= {"size": None, "called": None, "language": {"category": "red mug"}}
    return Draft("id", Item(file=None, name="red mug"), 0, fields, paths)


def test_the_caption_stage_returns_language(draft: Draft, tmp_path: Path) -> None:
    fields = CaptionStage(RulesAnnotator()).run(draft, tmp_path)
    language = Language(**json.loads(json.dumps(fields["language"])))
    assert (language.category, language.color, language.material) == ("mug", "red", "ceramic")


def test_the_caption_tells_the_sides_of_what_lies_askew(draft: Draft, tmp_path: Path) -> None:
    askew = trimesh.creation.box((0.3, 0.1, 0.05))
    askew.apply_transform(trimesh.transformations.rotation_matrix(0.7, [0, 0, 1]))
    np.savez(tmp_path / "solid.npz", vertices=askew.vertices, faces=askew.faces)
    language = CaptionStage(RulesAnnotator()).run(draft, tmp_path)["language"]
    assert language["size"] == "30 x 10 x 5 cm, medium-sized"


def test_the_points_stage_returns_candidates_at_their_places(draft: Draft, tmp_path: Path) -> None:
    fields = PointsStage(RulesAnnotator(), GRIPPER).run(draft, tmp_path)
    points, moved = fields["points"], {row["candidate"]: row for row in fields["refined_candidates"]}
    json.dumps(points, allow_nan=False)
    positions = draft.field("candidates")["positions_m"]
    functional = [FunctionalPoint(**point) for point in points["functional"]]
    for point in [*functional, *(GraspPoint(**point) for point in points["grasp"])]:
        was = moved.get(point.candidate)
        if was is None or isinstance(point, GraspPoint):
            assert point.position_m == positions[point.candidate]
        else:  # the views show it where the candidate was
            assert was["marked_position_m"] == positions[point.candidate] != point.position_m


class Changes(RulesAnnotator):
    """The rules, with their selection changed."""

    def __init__(self, change):
        self._change = change

    def select_points(self, request: PointsRequest) -> SelectedPoints:
        """Answer as the rules do, changed."""
        return self._change(super().select_points(request))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: replace(s, grasp=s.grasp[:1]), "1 grasp points, not 2 to 3"),
        (lambda s: replace(s, functional=s.functional[:1] * 2), "they must differ and be below 42"),
        (
            lambda s: replace(s, grasp=(s.grasp[0], s.grasp[1].model_copy(update={"candidate": 42}))),
            "they must differ and be below 42",
        ),
        (
            lambda s: replace(s, grasp=(s.grasp[0], s.grasp[1].model_copy(update={"position_m": [0, 0, 9]}))),
            "g1 is not at its candidate",
        ),
    ],
)
def test_points_that_are_no_candidates_are_no_answer(draft: Draft, tmp_path: Path, change, message: str) -> None:
    with pytest.raises(BadReply, match=message):
        PointsStage(Changes(change), GRIPPER).run(draft, tmp_path)


class _LooksCloser(RulesAnnotator):
    """Moves every functional point up by a millimetre."""

    def look_closer(self, request: PointsRequest, points: Sequence[FunctionalPoint]) -> CloserLook:
        up = np.array([0, 0, 0.001])
        places = {p.id: CloserPlace(np.array(p.position_m) + up, np.array([0, 0, 1.0])) for p in points}
        return CloserLook(places, {points[0].id: np.full((8, 8, 3), 200, np.uint8)})


def test_points_go_where_the_closer_look_saw_them_and_say_where_they_were_marked(draft: Draft, tmp_path: Path) -> None:
    fields = PointsStage(_LooksCloser(), GRIPPER).run(draft, tmp_path)
    assert [path.name for path in (tmp_path / "closer").iterdir()] == ["closer_f0.webp"]
    positions, moved = (
        draft.field("candidates")["positions_m"],
        {r["candidate"]: r for r in fields["refined_candidates"]},
    )
    shared = {p["candidate"] for p in (*fields["points"]["grasp"], *fields["spare_grasp_points"])}
    functional = fields["points"]["functional"]
    assert any(p["candidate"] not in shared for p in functional)
    for each in functional:
        was = positions[each["candidate"]]
        if each["candidate"] in shared:  # a grasp point lies there too
            assert each["position_m"] == was and each["candidate"] not in moved
        else:
            assert each["position_m"] != was and moved[each["candidate"]]["marked_position_m"] == was


class _Asked(RulesAnnotator):
    """Keeps the subjects that it is asked about."""

    def __init__(self) -> None:
        super().__init__()
        self.subjects: list[Subject] = []

    def describe(self, subject: Subject, material: str, extents_m: np.ndarray) -> Language:
        self.subjects.append(subject)
        return super().describe(subject, material, extents_m)

    def select_points(self, request: PointsRequest) -> SelectedPoints:
        self.subjects.append(request.subject)
        return super().select_points(request)


def test_what_it_was_taken_for_and_that_its_size_is_guessed_goes_on(draft: Draft, tmp_path: Path) -> None:
    asked = _Asked()
    for size in (None, {"value": 0.12}):
        draft.fields |= {"size": size, "called": "beaker"}
        CaptionStage(asked).run(draft, tmp_path)
        PointsStage(asked, GRIPPER).run(draft, tmp_path)
    assert [subject.known_as for subject in asked.subjects] == ["beaker", "red mug"] * 2
    assert [subject.size_estimated for subject in asked.subjects] == [False, False, True, True]
