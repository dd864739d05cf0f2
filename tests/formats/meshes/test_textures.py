from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.formats.meshes.shading_normals import with_creased_normals
from manitwin.formats.meshes.source import MeshLimits, MeshSource
from manitwin.formats.meshes.textures import bake_transform, color_by_corner, decode_texture, make_part, pbr_material


def _part(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    return make_part(mesh.vertices, mesh.faces, material=pbr_material(), name="thing")


def _sampled(image: Image.Image, uv: np.ndarray) -> np.ndarray:
    """Sample bilinearly as a GPU does: texel centres at (i + 0.5) / size, v from the bottom."""
    pixels = np.asarray(image, dtype=float)
    height, width = pixels.shape[:2]
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - x0)[:, None], (y - y0)[:, None]
    x1, y1 = np.minimum(x0 + 1, width - 1), np.minimum(y0 + 1, height - 1)
    x0, y0 = np.maximum(x0, 0), np.maximum(y0, 0)
    top = pixels[y0, x0] * (1 - fx) + pixels[y0, x1] * fx
    return top * (1 - fy) + (pixels[y1, x0] * (1 - fx) + pixels[y1, x1] * fx) * fy


def test_painted_texture_blends_the_corner_colours_across_every_face() -> None:
    part = _part(trimesh.creation.icosphere(subdivisions=2))
    rng = np.random.default_rng(3)
    colors = rng.integers(0, 256, size=(len(part.faces), 3, 3)).astype(np.uint8)
    painted = color_by_corner(part, colors)
    weights = rng.dirichlet((1, 1, 1), size=len(part.faces))
    uv = np.einsum("fk,fkc->fc", weights, painted.visual.uv[painted.faces])
    expected = np.einsum("fk,fkc->fc", weights, colors.astype(float))
    error = np.abs(_sampled(painted.visual.material.baseColorTexture, uv) - expected)
    assert np.percentile(error, 99) < 2.0 and error.mean() < 0.5
    np.testing.assert_allclose(painted.triangles, part.triangles)


def test_more_faces_than_an_atlas_holds_get_their_mean(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("manitwin.formats.meshes.textures._MAX_ATLAS", 16)
    part = _part(trimesh.creation.icosphere(subdivisions=2))
    painted = color_by_corner(part, np.full((len(part.faces), 3, 3), 255, np.uint8))
    assert painted.visual.material.baseColorTexture is None
    assert list(painted.visual.material.baseColorFactor) == [255, 255, 255, 255]


def test_creases_of_a_box_stay_sharp() -> None:
    box = with_creased_normals(_part(trimesh.creation.box()))
    assert len(box.vertices) == 24
    np.testing.assert_allclose(np.sort(np.abs(box.vertex_normals), axis=1), [[0, 0, 1]] * 24, atol=1e-12)
    np.testing.assert_allclose(np.einsum("fkc,fc->fk", box.vertex_normals[box.faces], box.face_normals), 1.0)


def test_normals_of_a_sphere_stay_smooth() -> None:
    sphere = with_creased_normals(_part(trimesh.creation.icosphere(subdivisions=3)))
    cosine = np.einsum("ij,ij->i", sphere.vertex_normals, sphere.vertices)
    assert len(sphere.vertices) == 642
    assert np.degrees(np.arccos(cosine.min())) < 0.5


def test_baked_shear_keeps_normals_perpendicular_to_the_surface() -> None:
    box = with_creased_normals(_part(trimesh.creation.box()))
    shear = np.array([[1.0, 0.7, 0, 1], [0, 2, 0, 0], [0.3, 0, -1, 0], [0, 0, 0, 1]])
    baked = bake_transform(box, shear)
    np.testing.assert_allclose(
        np.einsum("fkc,fc->fk", baked.vertex_normals[baked.faces], baked.face_normals), 1.0, atol=1e-9
    )
    assert baked.volume == pytest.approx(2.0)


def test_a_texture_that_git_has_not_fetched_is_told_so(tmp_path: Path) -> None:
    source = MeshSource(tmp_path / "mug.obj", MeshLimits())
    assert (
        decode_texture(b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n", "mug.png", source) is None
    )
    assert source.findings == ["texture 'mug.png' holds a pointer of Git LFS, not the file; fetch it with git lfs pull"]
