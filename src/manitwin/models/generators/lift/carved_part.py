"""Textured mesh of a carved solid: each face takes its colours from the photo that shows it best."""

from __future__ import annotations

import numpy as np
import trimesh
from trimesh.visual import TextureVisuals

from manitwin.geometry.poses import GLTF_TO_OBJECT, transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.generators.lift.carved_solid import CarvedSolid, CarvingPhoto
from manitwin.models.generators.lift.photo_atlas import photo_atlas
from manitwin.models.generators.lift.surface import bare_mesh
from manitwin.models.generators.photo_material import photo_material

SEEN_COSINE = 0.2  # faces seen at less than 12 degrees get painted colours
MOST_COLOUR_PHOTOS = 12
"""Maximum number of photos used for colours, spread over the directions; more would leave too few texture pixels for each."""


def carved_part(carved: CarvedSolid) -> trimesh.Trimesh:
    """Return the mesh in the object frame (Z up) with one texture: photos side by side, painted colours below them."""
    surface, photos = carved.surface, select_colour_photos(carved)
    view = _best_views(carved, photos)
    atlas, places = photo_atlas([photo.crop for photo in photos])
    key = surface.faces + len(surface.vertices) * view[:, None]
    used, faces = np.unique(key, return_inverse=True)
    vertex, chosen = used % len(surface.vertices), used // len(surface.vertices)
    points = transform_points(carved.to_carved, surface.vertices[vertex])
    uv = np.zeros((len(used), 2))
    for number, (left, top, width, height) in enumerate(places):
        own = chosen == number
        at = photos[number % len(photos)].crop_share(points[own])
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


def select_colour_photos(carved: CarvedSolid) -> tuple[CarvingPhoto, ...]:
    """Return the photos used for colours: all of them, or a subset spread over the directions."""
    photos = carved.photos
    if len(photos) <= MOST_COLOUR_PHOTOS:
        return photos
    toward = [photo.camera_directions(np.zeros((1, 3)))[0] for photo in photos]
    azimuths = np.array([np.arctan2(each[0], each[2]) for each in toward])
    order = np.argsort(np.round(azimuths - azimuths[0], 6) % (2 * np.pi), kind="stable")
    chosen = order[np.linspace(0, len(order), MOST_COLOUR_PHOTOS, endpoint=False).astype(int)]
    return tuple(photos[k] for k in sorted(chosen))


def seen_area_share(carved: CarvedSolid) -> float:
    """Return the share of the surface area that the photos used for colours show."""
    mesh, photos = bare_mesh(carved.surface), select_colour_photos(carved)
    areas = np.asarray(mesh.area_faces)
    return float(areas[_best_views(carved, photos) < len(photos)].sum() / areas.sum())


def _best_views(carved: CarvedSolid, photos: tuple[CarvingPhoto, ...]) -> np.ndarray:
    """Return for each face the index of the photo that shows it best, plus the number of photos if none shows it well."""
    mesh = bare_mesh(carved.surface)
    caster, normals, centers = RayCaster(mesh), np.asarray(mesh.face_normals), mesh.triangles_center
    scores = []
    for photo in photos:
        toward = photo.camera_directions(transform_points(carved.to_carved, centers))
        hit = caster.first_hits(centers + 1e-3 * normals, toward)[1] >= 0
        scores.append(np.where(hit, -1.0, (normals * toward).sum(axis=1)))
    best = np.argmax(scores, axis=0)
    return np.where(np.max(scores, axis=0) >= SEEN_COSINE, best, best + len(photos))
