"""A carved solid as a textured mesh, coloured by the photo that shows a place best."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh
from trimesh.visual import TextureVisuals

from manitwin.geometry.poses import GLTF_TO_OBJECT, transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.generators.lift.carving import HEIGHT_PX, Carved, Outline
from manitwin.models.generators.lift.surface import bare_mesh
from manitwin.models.generators.lift.texture import paint_unseen
from manitwin.models.generators.photo_material import photo_material

SEEN_COSINE = 0.2  # a face seen at less than 12 degrees takes painted colours


def carved_part(carved: Carved) -> trimesh.Trimesh:
    """Return the mesh in the object frame (Z up) with one texture: all photos side by side, painted colours below them."""
    surface, outlines = carved.surface, carved.outlines
    view = _best_views(carved)
    atlas, places = _atlas(outlines)
    key = surface.faces + len(surface.vertices) * view[:, None]
    used, faces = np.unique(key, return_inverse=True)
    vertex, chosen = used % len(surface.vertices), used // len(surface.vertices)
    points = transform_points(carved.to_pixels, surface.vertices[vertex])
    uv = np.zeros((len(used), 2))
    for number, (left, top, width, height) in enumerate(places):
        own = chosen == number
        at = _crop_share(outlines[number % len(outlines)], points[own])
        uv[own] = np.column_stack(
            [(left + at[:, 0] * width) / atlas.shape[1], 1 - (top + at[:, 1] * height) / atlas.shape[0]]
        )
    material = photo_material(atlas)
    return trimesh.Trimesh(
        surface.vertices[vertex] @ GLTF_TO_OBJECT[:3, :3].T,
        faces.reshape(-1, 3),
        visual=TextureVisuals(uv=uv, material=material),
        process=False,
        metadata={"name": "carved"},
    )


def seen_area_share(carved: Carved) -> float:
    """Return how much of a carved surface's area a photo shows."""
    mesh = bare_mesh(carved.surface)
    areas = np.asarray(mesh.area_faces)
    return float(areas[_best_views(carved) < len(carved.outlines)].sum() / areas.sum())


def _best_views(carved: Carved) -> np.ndarray:
    """Return for each face the photo that shows it best; plus the number of photos where none does."""
    mesh = bare_mesh(carved.surface)
    caster, normals, centers = RayCaster(mesh), np.asarray(mesh.face_normals), mesh.triangles_center
    scores = []
    for outline in carved.outlines:
        angle = np.deg2rad(outline.turn_deg)
        toward = np.array([np.sin(angle), 0.0, np.cos(angle)])
        hit = caster.first_hits(centers + 1e-3 * normals, np.tile(toward, (len(centers), 1)))[1] >= 0
        scores.append(np.where(hit, -1.0, normals @ toward))
    best = np.argmax(scores, axis=0)
    return np.where(np.max(scores, axis=0) >= SEEN_COSINE, best, best + len(carved.outlines))


def _crop_share(outline: Outline, points: np.ndarray) -> np.ndarray:
    """Return where points ``(N, 3)`` (x, height, z towards the first viewer) are in an outline's crop, 0 to 1 right and down."""
    rows = np.nonzero(outline.crop.mask.any(axis=1))[0]
    columns = np.nonzero(outline.crop.mask.any(axis=0))[0]
    scale = (rows[-1] + 1 - rows[0]) / HEIGHT_PX
    column = columns[0] + (outline.across(points[:, 0], -points[:, 2]) + 0.5) * scale
    row = rows[0] + (HEIGHT_PX - 0.5 - points[:, 1]) * scale
    height, width = outline.crop.mask.shape
    return np.clip(np.column_stack([column / width, row / height]), 0.0, 1.0)


def _atlas(outlines: Sequence[Outline]) -> tuple[np.ndarray, list[tuple[int, int, int, int]]]:
    """Return one picture of all photos, and below them of their painted colours, with the place of each (x, y, w, h)."""
    rows = [[o.crop.colours for o in outlines], [paint_unseen(o.crop, None) for o in outlines]]
    heights = [max(picture.shape[0] for picture in row) for row in rows]
    width = max(sum(picture.shape[1] for picture in row) for row in rows)
    atlas = np.zeros((sum(heights), width, 3), np.uint8)
    places, top = [], 0
    for row, height in zip(rows, heights, strict=True):
        left = 0
        for picture in row:
            atlas[top : top + picture.shape[0], left : left + picture.shape[1]] = picture
            places.append((left, top, picture.shape[1], picture.shape[0]))
            left += picture.shape[1]
        top += height
    return atlas, places
