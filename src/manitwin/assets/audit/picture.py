"""Picture of an asset for reports: visual meshes beside collision shapes."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import trimesh
from PIL import Image

from manitwin.assets.asset import Asset
from manitwin.assets.read import read_asset
from manitwin.assets.within_limits import run_within_limits
from manitwin.errors import AssetError
from manitwin.formats.meshes.textures import linear_to_srgb, material_of, uv_of
from manitwin.geometry.poses import rotation_between
from manitwin.geometry.ray_caster import RayCaster
from manitwin.render.cameras import Camera, hero_camera, pixel_rays
from manitwin.render.false_colors import id_color
from manitwin.render.raycast import cast_camera, merge_parts

PANEL_PX = 320
"""The side of each of the two panels."""

PICTURE = "manitwin.assets.audit.picture:picture_of_path"
_FINER = 2  # supersampling: rays along a pixel's side
_GROUND_RGB, _GREY = (246, 246, 244), (190, 190, 190)
_AMBIENT = 0.35
_LARGEST_M = 1e6  # larger coordinates are neither measured nor drawn
_FIELD_OF_VIEW_DEG = 30.0


def audited_picture(path: Path, root: Path | None = None) -> bytes | None:
    """Return the picture of the asset at a path, rendered in an isolated process; None if there is nothing to draw."""
    try:
        picture: bytes | None = run_within_limits(PICTURE, path, root)
    except AssetError:
        return None
    return picture


def picture_of_path(path: Path, root: Path | None = None) -> bytes | None:
    """Read the asset at a path and return its picture; raises AssetError if it cannot be read."""
    return asset_picture(read_asset(path, root=root))


def asset_picture(asset: Asset) -> bytes | None:
    """Return a PNG with two panels: the textured visual parts, and the collision shapes in different colours.

    Both are rendered by one camera, upright. Returns None if there are no faces, or a vertex is not finite.
    """
    seen = [part for part in asset.visual if len(part.faces)]
    felt = [
        trimesh.Trimesh(shape.vertices, shape.faces, process=False) for shape in asset.collision if len(shape.faces)
    ]
    points = [np.asarray(mesh.vertices, float)[np.unique(mesh.faces)] for mesh in (*seen, *felt)]
    if not points or not all((np.abs(each) <= _LARGEST_M).all() for each in points):  # also false for NaN
        return None
    upright = rotation_between(
        np.array([0.0, 1, 0]) if asset.up == "y" else np.array([0.0, 0, 1]), np.array([0.0, 0, 1])
    )
    corners = np.concatenate(points) @ upright.T
    if not np.ptp(corners, axis=0).any():
        return None
    side = PANEL_PX * _FINER
    camera = hero_camera(corners, fov_y_deg=_FIELD_OF_VIEW_DEG, width_px=side, height_px=side)
    panels = [
        _panel(seen, [_plain_color(part) for part in seen], upright, camera, textured=True),
        _panel(felt, [id_color(number + 1) for number in range(len(felt))], upright, camera),
    ]
    buffer = io.BytesIO()
    Image.fromarray(np.concatenate(panels, axis=1)).save(buffer, "PNG")
    return buffer.getvalue()


def _panel(
    parts: Sequence[trimesh.Trimesh],
    colors: Sequence[tuple[int, int, int]],
    upright: np.ndarray,
    camera: Camera,
    *,
    textured: bool = False,
) -> np.ndarray:
    """Return a picture ``(P, P, 3) uint8`` of parts in one colour each, or textured, lit from beside the camera.

    Faces are shaded on both sides.
    """
    picture = np.full((camera.height_px, camera.width_px, 3), _GROUND_RGB, np.uint8)
    if parts:
        mesh = merge_parts(list(parts))
        turned = trimesh.Trimesh(np.asarray(mesh.vertices) @ upright.T, mesh.faces, process=False)
        depth_m, normals, face = cast_camera(RayCaster(turned), camera)
        hit = face >= 0
        light = camera.camera_to_object[:3, :3] @ (np.array([-0.4, 0.5, 1.0]) / np.linalg.norm([-0.4, 0.5, 1.0]))
        shade = _AMBIENT + (1 - _AMBIENT) * np.abs(normals[hit] @ light)
        of_face = np.repeat(np.array(colors, float), [len(part.faces) for part in parts], axis=0)
        plain = of_face[face[hit]]
        if textured:
            origins, directions = pixel_rays(camera)
            points = (origins + directions * depth_m.reshape(-1, 1))[hit.reshape(-1)]
            _apply_textures(plain, parts, face[hit], points @ upright)
        picture[hit] = np.rint(plain * shade[:, None]).astype(np.uint8)
    return np.asarray(cv2.resize(picture, (PANEL_PX, PANEL_PX), interpolation=cv2.INTER_AREA))


def _apply_textures(
    colors: np.ndarray, parts: Sequence[trimesh.Trimesh], faces: np.ndarray, points: np.ndarray
) -> None:
    """Set ``colors (N, 3)`` of visible ``points (N, 3)`` to the colours of the parts' textures.

    ``faces (N,)`` are face indices in the concatenation of all parts.
    """
    first = 0
    for part in parts:
        texture, uv = material_of(part).baseColorTexture, uv_of(part)
        here = (faces >= first) & (faces < first + len(part.faces))
        if texture is not None and uv is not None and here.any():
            corners = np.asarray(part.faces)[faces[here] - first]
            shares = trimesh.triangles.points_to_barycentric(np.asarray(part.vertices)[corners], points[here])
            at = np.einsum("nk,nkj->nj", np.nan_to_num(shares), np.asarray(uv)[corners])
            pixels = np.asarray(texture.convert("RGB"))
            height, width = pixels.shape[:2]
            column = np.clip((at[:, 0] % 1.0 * width).astype(int), 0, width - 1)
            row = np.clip(((1.0 - at[:, 1] % 1.0) * height).astype(int), 0, height - 1)
            colors[here] = pixels[row, column]
        first += len(part.faces)


def _plain_color(part: trimesh.Trimesh) -> tuple[int, int, int]:
    """Return the sRGB colour of a part's material; for a textured one, the mean of its texture."""
    material = material_of(part)
    texture = material.baseColorTexture
    if texture is not None:
        red, green, blue = np.asarray(texture.convert("RGB").resize((8, 8))).reshape(-1, 3).mean(0)
        return round(float(red)), round(float(green)), round(float(blue))
    factor = material.baseColorFactor  # linear, in 255ths (``pbr_material``)
    if factor is None:
        return _GREY
    red, green, blue = 255 * linear_to_srgb(np.asarray(factor, float)[:3] / 255)
    return round(float(red)), round(float(green)), round(float(blue))
