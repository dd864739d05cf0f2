"""The short way through plain OBJ files gives what the long one does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from manitwin.formats.meshes.obj import plain_triangles, read_obj
from manitwin.formats.meshes.source import MeshLimits, MeshSource
from manitwin.geometry.hulls.reduction import hull_to_obj


def test_a_hull_is_the_same_both_ways(tmp_path: Path) -> None:
    hull = trimesh.creation.icosphere(subdivisions=2, radius=0.03)
    text = hull_to_obj(np.asarray(hull.vertices)).decode()
    (tmp_path / "plain.obj").write_text(text)
    (tmp_path / "grouped.obj").write_text("g hull\n" + text)  # a word more, and the full reader takes it
    assert plain_triangles(text) is not None and plain_triangles("g hull\n" + text) is None
    short, long = (read_obj(MeshSource(tmp_path / name, MeshLimits()))[0] for name in ("plain.obj", "grouped.obj"))
    assert np.array_equal(short.vertices, long.vertices) and np.array_equal(short.faces, long.faces)


TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


@pytest.mark.parametrize(
    "text",
    [
        "",
        TETRAHEDRON,
        TETRAHEDRON + "f 1 2 3",
        TETRAHEDRON + "f 1 2 3 4",
        TETRAHEDRON + "f 1 2\nf 3 4 1 2",
        TETRAHEDRON + "f 1 2 5\nf 2 3 4",
        TETRAHEDRON + "f -1 -2 -3\nf 1 2 3",
        TETRAHEDRON + "f 1/1 2/2 3/3\nf 2 3 4",
        TETRAHEDRON + "f 1 2 3 \\\n\nf 2 3 4",
        TETRAHEDRON.replace("0 0 1", "0 0 nan") + "f 1 2 3\nf 2 3 4",
        TETRAHEDRON.replace("v 0 0 1", "v 0 0 1 1 0 0") + "f 1 2 3\nf 2 3 4",
        TETRAHEDRON + "f 1 2 3\nf 2 3 99999999999999999999",
    ],
)
def test_anything_else_is_left_to_the_full_reader(text: str) -> None:
    assert plain_triangles(text) is None
