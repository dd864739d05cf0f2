"""Texture of a fitted template: photos where they show the surface, smooth colours elsewhere.

Unseen faces take colours of the same part: from the ring of equal height for parts of revolution about Z, else from the nearest
seen faces. A median over many faces keeps the base colour and removes print, which copying would mirror.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import trimesh
from manifold3d import Manifold, Mesh
from scipy.spatial import cKDTree

from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.solids.parts import PartedMesh
from manitwin.models.generators.bleeding import bleed_colours
from manitwin.models.generators.templates.fitting.view import View, normalised

TEXTURE_PX, MOST_WIDTH_PX = 1024, 4096
_CELL_PX = 48
_LONGEST_EDGE = 0.05  # of the half diagonal: size of the faces for which visibility is decided
_GRAZING_COSINE = 0.17  # 80 degrees: beyond, the photo gives streaks
_NEARBY = 0.022  # of the half diagonal: faces this close to an occluder may show it instead
_BEFORE = 0.05
_NEAREST = 48
_NEAR_AT_ONCE = 1 << 19  # neighbours per query: all unseen faces at once have ten times as many, 200 MB
_LEAST_SEEN = 6
_BORDER = 0.1
_ROUND_SPREAD = 0.03
_MARGIN = 0.05


@dataclass(frozen=True)
class FittedPhoto:
    """A photo ``rgba (H, W, 4) uint8`` and its view; ``center_px`` and ``box_px`` place the photo frame in it."""

    view: View
    rgba: np.ndarray
    center_px: tuple[float, float]
    box_px: float


@dataclass(frozen=True)
class TexturedSolid:
    """A refined solid: ``vertices (V, 3)`` m, ``faces (F, 3)``, ``uv (F, 3, 2)`` (v upward), ``texture (H, W, 3) uint8``.

    ``seen (F,)`` says whether a photo shows a face, ``part (F,)`` which part it belongs to.
    """

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray
    texture: np.ndarray
    seen: np.ndarray
    part: np.ndarray

    def mesh(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return vertices ``(N, 3)``, faces ``(F, 3)`` and uv ``(N, 2)`` with vertices split at texture seams."""
        corners = np.column_stack([self.faces.reshape(-1, 1), np.round(self.uv.reshape(-1, 2) * 65536)])
        _, first, index = np.unique(corners, axis=0, return_index=True, return_inverse=True)
        return self.vertices[self.faces.ravel()[first]], index.reshape(-1, 3), self.uv.reshape(-1, 2)[first]

    @property
    def unseen_share(self) -> float:
        """Share of the area that no photo shows."""
        a, b, c = (self.vertices[self.faces[:, corner]] for corner in range(3))
        areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        return float(areas[~self.seen].sum() / areas.sum())


def texture_solid(
    mesh: PartedMesh, shots: Sequence[FittedPhoto], colours: Mapping[str, tuple[float, float, float]]
) -> TexturedSolid:
    """Texture a solid from photos, each face from the photo that faces it most directly.

    ``colours`` (sRGB, 0..1) are used for parts that no photo shows.
    """
    fine = subdivide_mesh(mesh)
    points, center, half = normalised(fine.vertices)
    cosines = np.array([_visible_cosines(points, fine, shot.view) for shot in shots])
    best, seen = cosines.argmax(axis=0), cosines.max(axis=0) > 0
    side_px = min(TEXTURE_PX, MOST_WIDTH_PX // len(shots))
    pictures, places, shown = [], np.zeros((*fine.faces.shape, 2)), np.zeros((len(fine.faces), 3), np.float32)
    left = 0
    for number, shot in enumerate(shots):
        photo, origin, scale = _crop(shot.rgba, side_px)
        flat, _ = shot.view.project(points)
        pixels = (flat * shot.box_px + np.array(shot.center_px) - origin + 0.5) * scale - 0.5
        own = fine.faces[best == number]
        places[best == number] = pixels[own] + (left, 0)
        shown[best == number] = _sampled(photo, pixels)[own].mean(axis=1)
        pictures.append(photo)
        left += photo.shape[1]
    tones = _unseen_colours(points + center / half, fine, seen, shown, colours)
    cells, cell_uv = _charts(points, fine, ~seen, tones)
    texture, uv = _place_charts(_side_by_side(pictures), places, cells, cell_uv)
    return TexturedSolid(fine.vertices, fine.faces, uv, texture, seen, fine.part)


def _side_by_side(pictures: Sequence[np.ndarray]) -> np.ndarray:
    height = max(picture.shape[0] for picture in pictures)
    rows = [np.pad(picture, ((0, height - picture.shape[0]), (0, 0), (0, 0)), mode="edge") for picture in pictures]
    return np.concatenate(rows, axis=1)


def subdivide_mesh(mesh: PartedMesh) -> PartedMesh:
    """Return the same solid without long edges."""
    half = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))) / 2
    solid = Manifold(
        Mesh(
            vert_properties=np.ascontiguousarray(mesh.vertices / half, np.float32),
            tri_verts=np.ascontiguousarray(mesh.faces, np.uint32),
            face_id=np.ascontiguousarray(mesh.part, np.uint32),
        )
    )
    out = solid.refine_to_length(_LONGEST_EDGE).to_mesh()
    return PartedMesh(
        np.asarray(out.vert_properties, float)[:, :3] * half,
        np.asarray(out.tri_verts, np.int64),
        np.asarray(out.face_id, np.int64),
        mesh.names,
    )


def _visible_cosines(points: np.ndarray, mesh: PartedMesh, view: View) -> np.ndarray:
    """Return the cosine ``(F,)`` of the viewing angle of each face, 0 if it is not completely visible."""
    solid = trimesh.Trimesh(points, mesh.faces, process=False)
    caster, eye = RayCaster(solid), view.camera_position
    corners = points[mesh.faces]
    centers = corners.mean(axis=1)
    normals = np.asarray(solid.face_normals)
    toward = eye - centers
    cosine = (normals * toward).sum(axis=1) / np.linalg.norm(toward, axis=1)
    right, up = view.object_to_camera[0], view.object_to_camera[1]
    aside = [_NEARBY * (x * right + y * up) for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    targets = [centers, *(0.3 * centers + 0.7 * corners[:, corner] for corner in range(3))]
    free = cosine > _GRAZING_COSINE
    some = np.nonzero(free)[0]
    for target, slack in [*((t, 0.012) for t in targets), *((centers + step, _BEFORE) for step in aside)]:
        ray = target[some] - eye
        length = np.linalg.norm(ray, axis=1)
        distance, _ = caster.first_hits(np.broadcast_to(eye, ray.shape), ray / length[:, None])
        free[some] &= ~(distance < length - slack)
    return np.asarray(np.where(free, cosine, 0.0))


def _crop(rgba: np.ndarray, side_px: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the object's colours without background colours, the crop's corner in the photo (x, y), and its scale."""
    solid = rgba[..., 3] > 127
    rows, columns = np.nonzero(solid.any(axis=1))[0], np.nonzero(solid.any(axis=0))[0]
    margin = int(np.ceil(_MARGIN * max(np.ptp(rows), np.ptp(columns)))) + 2
    top, left = max(0, rows[0] - margin), max(0, columns[0] - margin)
    box = rgba[top : rows[-1] + margin + 1, left : columns[-1] + margin + 1]
    scale = min(1.0, side_px / max(box.shape[:2]))
    if scale < 1:
        size = (round(box.shape[1] * scale), round(box.shape[0] * scale))
        box = cv2.resize(box, size, interpolation=cv2.INTER_AREA)
    return bleed_colours(np.ascontiguousarray(box[..., :3]), box[..., 3] > 200), np.array([left, top]), scale


def _sampled(photo: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Return the photo's smoothed colours ``(V, 3)`` at positions ``(V, 2)``."""
    soft = cv2.GaussianBlur(photo, (0, 0), max(1.0, 0.006 * max(photo.shape)))
    at = pixels.astype(np.float32)
    channels = [
        cv2.remap(channel.astype(np.float32), at[:, :1], at[:, 1:], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        for channel in cv2.split(soft)
    ]
    return np.concatenate(channels, axis=1)


def _unseen_colours(
    points: np.ndarray,
    mesh: PartedMesh,
    seen: np.ndarray,
    of_face: np.ndarray,
    colours: Mapping[str, tuple[float, float, float]],
) -> np.ndarray:
    """Return a colour ``(F, 3)`` for each face that is not ``seen``, 0 for the others.

    It is derived from the photo colours ``of_face (F, 3)`` of seen faces of its part.
    """
    centers = points[mesh.faces].mean(axis=1)
    tones = np.zeros((len(centers), 3))
    shown_as: dict[tuple[float, float, float], np.ndarray] = {}  # a seen part gives the colour of others with its look
    for name in mesh.names:
        known = (mesh.part == mesh.names.index(name)) & seen
        if known.sum() >= _LEAST_SEEN and colours[name] not in shown_as:
            shown_as[colours[name]] = np.median(of_face[known], axis=0)
    for number, name in enumerate(mesh.names):
        own = mesh.part == number
        known, wanted = own & seen, own & ~seen
        if not wanted.any():
            continue
        if known.sum() < _LEAST_SEEN:
            tones[wanted] = shown_as.get(colours[name], 255 * np.array(colours[name]))
            continue
        some, there = of_face[known], centers[known]
        places = _radius_and_height(centers) if _is_turned(centers[own]) else centers
        count = min(len(some), max(_NEAREST, len(some) // 8))
        quiet = _nearest_medians(some, cKDTree(places[known]), places[wanted], count)
        # Blend the colours at the border of the seen region.
        distance, close = cKDTree(there).query(centers[wanted], k=6)
        share = np.exp(-((distance[:, 0] / _BORDER) ** 2))[:, None]
        tones[wanted] = share * some[close].mean(axis=1) + (1 - share) * quiet
    return tones


def _nearest_medians(colours: np.ndarray, tree: cKDTree, places: np.ndarray, count: int) -> np.ndarray:
    """Return the median ``(M, 3)`` of the ``count`` nearest ``colours (N, 3)`` for each position, by the tree of their points."""
    at_once = max(1, _NEAR_AT_ONCE // count)
    channels = np.ascontiguousarray(colours.T)
    medians = np.empty((len(places), 3))
    for first in range(0, len(places), at_once):
        some = np.s_[first : first + at_once]
        _, near = tree.query(places[some], k=count)
        near = near.reshape(-1, count)
        medians[some] = np.column_stack([np.median(channel[near], axis=1) for channel in channels])
    return medians


def _is_turned(centers: np.ndarray) -> bool:
    """Return whether the face centres of a part lie on rings about Z, so that the radius is nearly constant at each height."""
    radius, height = np.hypot(centers[:, 0], centers[:, 1]), centers[:, 2]
    if radius.max() < 1e-6 or len(centers) < 24:
        return False
    angle = np.arctan2(centers[:, 1], centers[:, 0])
    if len(np.unique(np.floor(angle / (np.pi / 4)))) < 8:
        return False
    order = np.lexsort((radius, np.round(height, 2)))
    groups = np.split(radius[order], np.nonzero(np.diff(np.round(height, 2)[order]))[0] + 1)
    return float(np.median([np.ptp(group) for group in groups])) < _ROUND_SPREAD


def _radius_and_height(centers: np.ndarray) -> np.ndarray:
    """Return radius and height ``(N, 2)``, which identify points of one ring."""
    return np.column_stack([np.hypot(centers[:, 0], centers[:, 1]), centers[:, 2]])


def _charts(
    points: np.ndarray, mesh: PartedMesh, wanted: np.ndarray, tones: np.ndarray
) -> tuple[list[np.ndarray], dict[int, tuple[int, np.ndarray]]]:
    """Return small images with the colours of the wanted faces, and for each face its image and corners ``(3, 2)`` in it.

    A chart holds the faces of a part with one dominant normal direction, projected along it. Faces behind each other may overlap,
    since their colours are smooth.
    """
    normals = np.cross(
        points[mesh.faces[:, 1]] - points[mesh.faces[:, 0]], points[mesh.faces[:, 2]] - points[mesh.faces[:, 0]]
    )
    axis = np.abs(normals).argmax(axis=1)
    side = 2 * axis + (normals[np.arange(len(axis)), axis] < 0)
    cells: list[np.ndarray] = []
    places: dict[int, tuple[int, np.ndarray]] = {}
    grid = np.stack(np.meshgrid(np.arange(_CELL_PX), np.arange(_CELL_PX)), -1).reshape(-1, 2)
    for part in range(len(mesh.names)):
        for direction in range(6):
            chosen = np.nonzero(wanted & (mesh.part == part) & (side == direction))[0]
            if not len(chosen):
                continue
            flat = points[mesh.faces[chosen]][..., [k for k in range(3) if k != direction // 2]]
            low, high = flat.min(axis=(0, 1)), flat.max(axis=(0, 1))
            inside = 1.5 + (flat - low) / np.maximum(high - low, 1e-9) * (_CELL_PX - 4)
            tree = cKDTree(inside.mean(axis=1))
            distance, near = tree.query(grid, k=min(4, len(chosen)))
            near, weight = near.reshape(len(grid), -1), 1 / (distance.reshape(len(grid), -1) + 0.7)
            colour = (tones[chosen][near] * weight[..., None]).sum(axis=1) / weight.sum(axis=1, keepdims=True)
            cells.append(colour.reshape(_CELL_PX, _CELL_PX, 3))
            places |= {int(face): (len(cells) - 1, inside[k]) for k, face in enumerate(chosen)}
    return cells, places


def _place_charts(
    photo: np.ndarray, at: np.ndarray, cells: list[np.ndarray], places: dict[int, tuple[int, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray]:
    """Place the charts beside the photo, whose face corners are ``at (F, 3, 2)``; return the image and the uv coordinates."""
    rows = max(1, photo.shape[0] // _CELL_PX)
    columns = -(-len(cells) // rows)
    height, width = max(photo.shape[0], _CELL_PX), photo.shape[1] + columns * _CELL_PX
    picture = np.zeros((height, width, 3), np.uint8)
    picture[: photo.shape[0], : photo.shape[1]] = photo
    corners = np.array([(photo.shape[1] + (k // rows) * _CELL_PX, (k % rows) * _CELL_PX) for k in range(len(cells))])
    for cell, (x, y) in zip(cells, corners, strict=True):
        picture[y : y + _CELL_PX, x : x + _CELL_PX] = np.clip(cell + 0.5, 0, 255)
    at = at.copy()
    for face, (cell_number, inside) in places.items():
        at[face] = inside + corners[cell_number]
    uv = (at + 0.5) / (width, height)
    return picture, np.stack([uv[..., 0], 1 - uv[..., 1]], axis=-1)
