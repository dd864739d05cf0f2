"""Model and render the project's own sample inputs: a photo of a bottle and a mesh of a mug.

    python samples/make_samples.py [FOLDER]

Both are made from nothing but this file: ``bottle.jpg`` is ray-traced on the CPU, with a soft shadow, falling light and
sensor noise, and has no alpha channel; ``mug.glb`` has both walls, a handle and a texture, in metres. The same bytes each time.
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import manifold3d
import numpy as np
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from manitwin.formats.glb import write_glb

PHOTO_SIZE_PX = (480, 640)
_SIDES = 96
_LIGHT_SAMPLES = 6
_CAMERA_M = np.array([0.0, -1.3, 0.36])
_TARGET_M = np.array([0.0, 0.0, 0.082])
_FOCAL_PX = 1900.0


def bottle_mesh() -> trimesh.Trimesh:
    """Return a bottle of 0.2 m that stands on z = 0."""
    profile = np.array(
        [
            [0.0, 0.0], [0.028, 0.0], [0.0315, 0.003], [0.0325, 0.010], [0.0325, 0.118], [0.0310, 0.130], [0.0260, 0.145],
            [0.0185, 0.157], [0.0135, 0.166], [0.0125, 0.174], [0.0125, 0.1765], [0.0155, 0.1770], [0.0155, 0.1975],
            [0.0145, 0.2], [0.0, 0.2],
        ]
    )  # fmt: skip
    return trimesh.creation.revolve(profile, sections=_SIDES)


def bottle_colour(points: np.ndarray) -> np.ndarray:
    """Return the linear colour (N, 3) of points on the bottle: green, a pale label with two stripes, a red cap."""
    height = points[:, 2]
    angle = np.degrees(np.arctan2(points[:, 0], -points[:, 1]))
    colour = np.tile([0.035, 0.22, 0.11], (len(points), 1))
    label = (height > 0.040) & (height < 0.105)
    colour[label] = [0.78, 0.70, 0.50]
    colour[label & (np.abs(height - 0.050) < 0.003)] = [0.03, 0.10, 0.30]
    colour[label & (np.abs(height - 0.095) < 0.003)] = [0.03, 0.10, 0.30]
    dots = (np.abs((angle + 180) % 40 - 20) / 14) ** 2 + (np.abs(height - 0.0725) / 0.011) ** 2 < 1
    colour[label & dots] = [0.62, 0.08, 0.05]
    colour[height > 0.1768] = [0.55, 0.04, 0.03]
    return colour


def render_bottle() -> np.ndarray:
    """Return the photo (H, W, 3) uint8 sRGB."""
    rng = np.random.default_rng(20)
    mesh = bottle_mesh()
    total = np.zeros((PHOTO_SIZE_PX[1], PHOTO_SIZE_PX[0], 3))
    offsets = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)]
    for dx, dy in offsets:
        total += _trace(mesh, dx, dy, rng) / len(offsets)
    total *= 1 + rng.normal(0, 0.012, total.shape)
    encoded = np.where(total <= 0.0031308, 12.92 * total, 1.055 * np.maximum(total, 1e-9) ** (1 / 2.4) - 0.055)
    return (np.clip(encoded, 0, 1) * 255 + 0.5).astype(np.uint8)


def _trace(mesh: trimesh.Trimesh, dx: float, dy: float, rng: np.random.Generator) -> np.ndarray:
    width, height = PHOTO_SIZE_PX
    forward = (_TARGET_M - _CAMERA_M) / np.linalg.norm(_TARGET_M - _CAMERA_M)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    x, y = np.meshgrid(np.arange(width) + dx - width / 2, height / 2 - np.arange(height) - dy)
    rays = (x.ravel()[:, None] * right + y.ravel()[:, None] * up) / _FOCAL_PX + forward
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    faces = mesh.ray.intersects_first(np.tile(_CAMERA_M, (len(rays), 1)), rays)
    on_bottle = faces >= 0
    corners = mesh.triangles[faces[on_bottle]]
    plane = mesh.face_normals[faces[on_bottle]]
    distance = -_CAMERA_M[2] / np.minimum(rays[:, 2], -1e-3)
    distance[on_bottle] = ((corners[:, 0] - _CAMERA_M) * plane).sum(1) / (rays[on_bottle] * plane).sum(1)
    points = _CAMERA_M + rays * distance[:, None]
    normals = np.tile([0.0, 0.0, 1.0], (len(rays), 1))
    barycentric = trimesh.triangles.points_to_barycentric(corners, points[on_bottle])
    smooth = (mesh.vertex_normals[mesh.faces[faces[on_bottle]]] * barycentric[..., None]).sum(1)
    normals[on_bottle] = smooth / np.linalg.norm(smooth, axis=1, keepdims=True)
    colour = np.tile([0.60, 0.57, 0.53], (len(rays), 1))
    colour[on_bottle] = bottle_colour(points[on_bottle])
    return _shade(mesh, points, normals, rays, colour, on_bottle, rng).reshape(height, width, 3)


def _shade(
    mesh: trimesh.Trimesh,
    points: np.ndarray,
    normals: np.ndarray,
    rays: np.ndarray,
    colour: np.ndarray,
    on_bottle: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    centre = np.array([-0.55, -0.75, 1.0])
    origin = points + 1e-4 * normals
    near = on_bottle | (np.linalg.norm(points[:, :2], axis=1) < 0.35)
    direct = np.zeros(len(points))
    gloss = np.zeros(len(points))
    for _ in range(_LIGHT_SAMPLES):
        light = centre + np.column_stack([rng.uniform(-0.25, 0.25, (len(points), 2)), np.zeros(len(points))])
        to_light = light - origin
        to_light /= np.linalg.norm(to_light, axis=1, keepdims=True)
        lit = np.ones(len(points))
        lit[near] = ~mesh.ray.intersects_any(origin[near], to_light[near])
        direct += lit * np.maximum((normals * to_light).sum(1), 0) / _LIGHT_SAMPLES
        half = to_light - rays
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        gloss += lit * on_bottle * np.maximum((normals * half).sum(1), 0) ** 60 / _LIGHT_SAMPLES
    ambient = 0.42 + 0.18 * normals[:, 2]
    falloff = 1.0 - 0.28 * np.linalg.norm(points[:, :2] - [-0.1, -0.1], axis=1)
    light = (0.75 * direct + ambient) * np.where(on_bottle, 1.0, np.clip(falloff, 0.55, 1.0))
    return colour * light[:, None] + 0.25 * gloss[:, None]


def mug_mesh() -> trimesh.Trimesh:
    """Return a mug of 95 mm with a handle, both walls and a texture, standing on z = 0, in metres."""
    outer = np.array(
        [[0, 0], [0.036, 0], [0.0395, 0.0025], [0.041, 0.006], [0.041, 0.0935], [0.0402, 0.095], [0, 0.095]]
    )
    inner = np.array(
        [[0, 0.006], [0.031, 0.006], [0.0355, 0.0085], [0.037, 0.0125], [0.037, 0.0935], [0.0378, 0.096], [0, 0.096]]
    )
    body, cavity = _solid(_fine(outer)), _solid(_fine(inner))
    solid = (body + _handle()) - cavity
    mesh = solid.to_mesh()
    vertices, faces = np.asarray(mesh.vert_properties, float)[:, :3], np.asarray(mesh.tri_verts, np.int64)
    turned = np.abs(np.arctan2(vertices[:, 1], vertices[:, 0])) / np.pi  # mirrored: no seam
    uv = np.column_stack([0.02 + 0.96 * turned, 0.02 + 0.96 * vertices[:, 2] / 0.095])
    material = PBRMaterial(
        baseColorFactor=[255, 255, 255, 255],
        baseColorTexture=_glaze(),
        metallicFactor=0.0,
        roughnessFactor=0.35,
        name="glaze",
    )
    visual = TextureVisuals(uv=uv, material=material)
    return trimesh.Trimesh(vertices, faces, visual=visual, process=False, metadata={"name": "mug"})


def _fine(profile: np.ndarray) -> np.ndarray:
    """Split long sides of a profile so that triangles stay compact."""
    points = [profile[0]]
    for a, b in pairwise(profile):
        steps = max(1, int(np.ceil(np.linalg.norm(b - a) / 0.008)))
        points += [a + (b - a) * k / steps for k in range(1, steps + 1)]
    return np.array(points)


def _solid(profile: np.ndarray) -> manifold3d.Manifold:
    mesh = trimesh.creation.revolve(profile, sections=64)
    return manifold3d.Manifold(manifold3d.Mesh(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32)))


def _handle() -> manifold3d.Manifold:
    """Return a ring segment of oval section on the +x side; its ends reach into the wall."""
    turns, around = np.linspace(-0.62 * np.pi, 0.62 * np.pi, 33), 2 * np.pi * np.arange(20) / 20
    centre = np.column_stack([0.0445 + 0.024 * np.cos(turns), np.zeros(33), 0.050 + 0.027 * np.sin(turns)])
    outward = np.column_stack([np.cos(turns), np.zeros(33), np.sin(turns)])
    across = np.array([0, 1, 0])
    ring = np.cos(around)[None, :, None] * 0.0042 * outward[:, None] + np.sin(around)[None, :, None] * 0.0062 * across
    vertices = np.concatenate([(centre[:, None] + ring).reshape(-1, 3), centre[[0, -1]]])
    i, j = np.meshgrid(np.arange(32), np.arange(20), indexing="ij")
    a, b = i * 20 + j, i * 20 + (j + 1) % 20
    sides = np.concatenate(
        [np.stack([a, b, a + 20], -1).reshape(-1, 3), np.stack([b, b + 20, a + 20], -1).reshape(-1, 3)]
    )
    k = np.arange(20)
    start = np.column_stack([np.full(20, len(vertices) - 2), (k + 1) % 20, k])
    end = np.column_stack([np.full(20, len(vertices) - 1), 640 + k, 640 + (k + 1) % 20])
    faces = np.concatenate([sides, start, end])
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if mesh.volume < 0:
        faces = faces[:, ::-1]
    return manifold3d.Manifold(manifold3d.Mesh(vertices.astype(np.float32), np.ascontiguousarray(faces, np.uint32)))


def _glaze() -> Image.Image:
    """Return the texture: blue glaze, a white band, darker towards the foot."""
    v = np.linspace(1, 0, 256)[:, None]
    u = np.linspace(0, 1, 256)[None, :]
    colour = np.broadcast_to(np.array([52, 96, 148], float), (256, 256, 3)) * (0.85 + 0.15 * v)[..., None]
    wave = 0.60 + 0.05 * np.sin(12 * np.pi * u)
    band = np.abs(v - wave) < 0.045
    return Image.fromarray(np.where(band[..., None], [236, 232, 222], colour).astype(np.uint8))


def main(folder: Path) -> None:
    """Write both samples."""
    Image.fromarray(render_bottle()).save(folder / "bottle.jpg", quality=90)
    (folder / "mug.glb").write_bytes(write_glb([mug_mesh()]))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
