"""The closer look on a box, whose faces' middles are known."""

import numpy as np
import pytest
import trimesh

from manitwin.geometry.frames.feature import FramedMesh
from manitwin.pipeline.frames import with_frames
from manitwin.pipeline.refinement import refined_points
from manitwin.twin.point_records import FunctionalPoint

BOX = trimesh.creation.box((0.1, 0.06, 0.04))
SURFACE = FramedMesh(BOX, np.zeros(3), 0)


def point(label: str, position_m: list[float]) -> FunctionalPoint:
    return FunctionalPoint(
        id="f0",
        candidate=7,
        position_m=position_m,
        normal=[0, 0, 1],
        label=label,
        description="a place",
        confidence=1,
        rationale="for a test",
    )


def test_point_moves_to_the_middle_of_its_face_and_leaves_where_it_was_marked() -> None:
    framed, missing = with_frames([point("screen", [0.012, 0.004, 0.02])], SURFACE)
    (moved,), (row,) = refined_points(framed, SURFACE, set(), lambda place: True)
    assert not missing and moved.position_m == pytest.approx([0, 0, 0.02], abs=1e-6)
    assert (row.candidate, row.marked_position_m) == (7, [0.012, 0.004, 0.02]) and moved.frame == framed[0].frame


@pytest.mark.parametrize("label", ["top", "inside", "part without a name"])
def test_what_means_more_than_its_feature_stays(label: str) -> None:
    framed, _ = with_frames([point(label, [0.012, 0.004, 0.02])], SURFACE)
    assert refined_points(framed, SURFACE, set(), lambda place: True) == (framed, [])


def test_shared_candidates_and_places_that_no_view_shows_stay() -> None:
    framed, _ = with_frames([point("screen", [0.012, 0.004, 0.02])], SURFACE)
    assert refined_points(framed, SURFACE, {7}, lambda place: True) == (framed, [])
    assert refined_points(framed, SURFACE, set(), lambda place: False) == (framed, [])


def test_point_without_a_clear_feature_has_no_frame_and_a_reason() -> None:
    framed, missing = with_frames([point("opening", [0.012, 0.004, 0.02])], SURFACE)
    assert framed[0].frame is None and len(missing) == 1 and "hold water" in missing[0]
