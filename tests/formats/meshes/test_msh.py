"""MuJoCo's own binary meshes, held against MuJoCo."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh
from manitwin.formats.meshes.source import MeshLimits
from manitwin.formats.meshes.textures import normals_of, uv_of


def write_msh(file: Path, mesh: trimesh.Trimesh, normals: bool = True, coordinates: bool = True) -> Path:
    """Write a mesh with its normals and texture coordinates that count up."""
    count = len(mesh.vertices)
    uv = np.linspace(0, 1, 2 * count)
    header = np.array([count, count * normals, count * coordinates, len(mesh.faces)], "<i4").tobytes()
    blocks = [mesh.vertices, mesh.vertex_normals if normals else [], uv if coordinates else []]
    floats = b"".join(np.asarray(block, "<f4").tobytes() for block in blocks)
    file.write_bytes(header + floats + np.asarray(mesh.faces, "<i4").tobytes())
    return file


@pytest.mark.parametrize(("normals", "coordinates"), [(True, True), (False, False), (True, False)])
def test_positions_normals_and_coordinates_are_those_of_the_file(
    tmp_path: Path, normals: bool, coordinates: bool
) -> None:
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.1)
    read = read_mesh(write_msh(tmp_path / "ball.msh", ball, normals, coordinates))
    (part,) = read.parts
    assert (read.format, read.unit_m, read.up, read.findings) == ("msh", None, None, [])
    assert np.allclose(part.vertices[part.faces], ball.vertices[ball.faces], atol=1e-6)
    if normals:
        assert np.allclose(normals_of(part), ball.vertex_normals, atol=1e-5)
    uv = uv_of(part)
    if coordinates:
        assert uv is not None and np.allclose(uv[-1], [np.linspace(0, 1, 2 * len(ball.vertices))[-2], 0.0])


def test_mujoco_reads_the_same_solid(tmp_path: Path) -> None:
    wedge = trimesh.convex.convex_hull(np.array([[5, 0, 0], [8, 0, 0], [5, 2, 0], [5, 0, 1.0], [6, 1, 1]]))
    write_msh(tmp_path / "wedge.msh", wedge)
    geom = "<geom type='mesh' mesh='m' density='1'/>"
    (tmp_path / "a.xml").write_text(
        f"<mujoco><asset><mesh name='m' file='wedge.msh'/></asset><worldbody><body>{geom}</body></worldbody></mujoco>"
    )
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "a.xml"))
    (part,) = read_mesh(tmp_path / "wedge.msh").parts
    assert model.body_mass[1] == pytest.approx(part.volume, rel=1e-5)
    assert np.allclose(model.body_ipos[1], part.center_mass, atol=1e-5)


def test_what_is_broken_or_too_large_is_refused(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.1)
    whole = write_msh(tmp_path / "ball.msh", ball).read_bytes()
    with pytest.raises(InputError, match="faces exceed the limit"):
        read_mesh(tmp_path / "ball.msh", limits=MeshLimits(max_faces=10))
    (tmp_path / "cut.msh").write_bytes(whole[:-4])
    with pytest.raises(InputError, match="unknown binary data"):
        read_mesh(tmp_path / "cut.msh")
    wrong = whole[:-4] + np.array([10_000], "<i4").tobytes()
    (tmp_path / "wrong.msh").write_bytes(wrong)
    with pytest.raises(InputError, match="a face refers to a vertex that does not exist"):
        read_mesh(tmp_path / "wrong.msh")
