from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.geometry.hulls.through_holes import holes_kept

FRAME = [
    trimesh.creation.box(bounds=bounds)
    for bounds in (
        [(-0.03, -0.03, 0), (-0.01, 0.03, 0.01)],
        [(0.01, -0.03, 0), (0.03, 0.03, 0.01)],
        [(-0.01, -0.03, 0), (0.01, -0.01, 0.01)],
        [(-0.01, 0.01, 0), (0.01, 0.03, 0.01)],
    )
]
TILTED = trimesh.transformations.rotation_matrix(0.7, [1, 0.4, 0.2])


def _moved(box: trimesh.Trimesh, to_object: np.ndarray) -> np.ndarray:
    return np.asarray(box.copy().apply_transform(to_object).vertices)


@pytest.mark.parametrize("to_object", [np.eye(4), TILTED], ids=["level", "tilted"])
def test_what_hulls_cover_of_a_hole_is_not_kept(to_object: np.ndarray) -> None:
    solid = trimesh.boolean.union(FRAME).apply_transform(to_object)
    hulls = [_moved(box, to_object) for box in FRAME]
    half = trimesh.creation.box(bounds=[(-0.01, -0.01, 0.004), (0, 0.01, 0.0043)])
    assert holes_kept(solid, hulls) == pytest.approx(1.0, abs=1e-6)
    assert holes_kept(solid, [*hulls, _moved(half, to_object)]) == pytest.approx(0.5, abs=1e-6)
    assert holes_kept(solid, [np.asarray(solid.vertices)]) == pytest.approx(0.0, abs=1e-6)


def test_of_two_holes_the_one_that_is_closed_counts() -> None:
    second = [box.copy().apply_translation((0.06, 0, 0)) for box in FRAME]
    solid = trimesh.boolean.union([*FRAME, *second])
    hulls = [np.asarray(box.vertices) for box in FRAME]
    assert holes_kept(solid, [*hulls, *(np.asarray(box.vertices) for box in second)]) == pytest.approx(1.0, abs=1e-6)
    assert holes_kept(solid, [*hulls, np.vstack([box.vertices for box in second])]) == pytest.approx(0.0, abs=1e-6)


def test_a_thing_without_a_hole_has_none_to_keep() -> None:
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    assert holes_kept(box, [np.asarray(box.vertices)]) is None
    apart = trimesh.util.concatenate([box, box.copy().apply_translation((0.3, 0, 0))])
    assert holes_kept(apart, [np.asarray(apart.vertices)]) is None
