from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.formats.meshes.repaired_parts import repaired_parts
from manitwin.formats.meshes.textures import make_part, pbr_material
from manitwin.geometry.repair.cascade import repair


def _parts(mesh: trimesh.Trimesh) -> list[trimesh.Trimesh]:
    """The mesh in two halves, one red and one green."""
    half = len(mesh.faces) // 2
    colors = ((1, 0, 0), (0, 1, 0))
    return [
        make_part(
            mesh.vertices, faces, material=pbr_material(base_color=color), name="half", normals=mesh.vertex_normals
        )
        for faces, color in zip((mesh.faces[:half], mesh.faces[half:]), colors, strict=True)
    ]


def _repaired(parts: list[trimesh.Trimesh]) -> tuple[trimesh.Trimesh, list[trimesh.Trimesh]]:
    vertices, faces = trimesh.util.append_faces([p.vertices for p in parts], [p.faces for p in parts])
    result = repair(trimesh.Trimesh(vertices, faces, process=False))
    assert result.watertight
    return result.mesh, repaired_parts(parts, result)


def _volume(parts: list[trimesh.Trimesh]) -> float:
    triangles = np.concatenate([part.triangles for part in parts])
    return float(np.einsum("ij,ij->", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])) / 6)


def test_sound_parts_are_not_touched() -> None:
    parts = _parts(trimesh.creation.icosphere(subdivisions=2))
    _, shown = _repaired(parts)
    assert [id(part) for part in shown] == [id(part) for part in parts]


def test_flipped_faces_turn_over_with_their_normals() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=2)
    parts = _parts(sphere)
    wrong = np.zeros(len(parts[0].faces), dtype=bool)
    wrong[::7] = True
    parts[0] = make_part(
        parts[0].vertices,
        np.where(wrong[:, None], parts[0].faces[:, ::-1], parts[0].faces),
        material=parts[0].visual.material,
        name="half",
        normals=sphere.vertex_normals,
    )
    solid, shown = _repaired(parts)
    assert _volume(shown) == pytest.approx(solid.volume) == pytest.approx(sphere.volume)
    # the vertices of turned faces point inward now, as their stored normals were for the wrong side
    facing = np.einsum("fkc,fc->fk", shown[0].vertex_normals[shown[0].faces], shown[0].face_normals)
    assert (facing[~wrong] > 0.9).all()


def test_patch_has_the_colour_of_its_surroundings() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=3)
    parts = _parts(sphere)
    far = parts[1].triangles_center @ parts[1].triangles_center.mean(0)
    keep = far < np.sort(far)[-6]
    parts[1] = make_part(parts[1].vertices, parts[1].faces[keep], material=parts[1].visual.material, name="half")
    solid, shown = _repaired(parts)
    assert [part.metadata["name"] for part in shown] == ["half", "half", "patch"]
    assert sum(len(part.faces) for part in shown) == len(solid.faces)
    assert _volume(shown) == pytest.approx(solid.volume)
    assert list(shown[-1].visual.material.baseColorFactor) == [0, 255, 0, 255]


def test_repeated_faces_vanish_from_the_picture_too() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=2)
    parts = _parts(sphere)
    parts.append(make_part(sphere.vertices, sphere.faces[:20, ::-1], material=pbr_material(), name="double"))
    solid, shown = _repaired(parts)
    assert sum(len(part.faces) for part in shown) == len(solid.faces) == len(sphere.faces)
