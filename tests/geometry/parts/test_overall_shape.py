"""One word for a whole shape."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import cylinder, hammer
from manitwin.geometry.parts.overall_shape import overall_shape

TILTED = trimesh.transformations.rotation_matrix(0.6, [1, 0.4, 0.2])


@pytest.mark.parametrize(
    ("mesh", "word"),
    [
        (trimesh.creation.box([0.1, 0.08, 0.06]), "box-shaped"),
        (trimesh.creation.box([0.1, 0.08, 0.06]).apply_transform(TILTED), "box-shaped"),
        (trimesh.creation.box([0.3, 0.03, 0.03]), "bar-shaped"),
        (trimesh.creation.box([0.2, 0.15, 0.02]), "slab-shaped"),
        (cylinder(0.03, 0.1), "cylindrical"),
        (cylinder(0.03, 0.1).apply_transform(TILTED), "cylindrical"),
        (cylinder(0.1, 0.02), "disc-shaped"),
        (trimesh.creation.icosphere(radius=0.04), "round"),
        (hammer(), "elongated"),
    ],
)
def test_plain_shapes_get_their_word(mesh: trimesh.Trimesh, word: str) -> None:
    assert overall_shape(mesh, np.random.default_rng(0)).word == word


def test_proportions_are_those_of_the_box() -> None:
    shape = overall_shape(trimesh.creation.box([0.2, 0.1, 0.05]), np.random.default_rng(0))
    assert shape.elongation == pytest.approx(2.0, rel=0.02) and shape.flatness == pytest.approx(2.0, rel=0.02)
    assert shape.box_fill == pytest.approx(1.0, rel=0.02)
