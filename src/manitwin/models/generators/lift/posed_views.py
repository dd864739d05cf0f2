"""Textured mesh from photos with stated cameras, in metres if the unit of the poses is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import trimesh

from manitwin.formats.camera_poses.posed_camera import PosedCamera
from manitwin.geometry.boxes import upright_extents
from manitwin.models.generators.lift.carved_solid import CarvedSolid
from manitwin.models.generators.lift.multi_view_result import MultiViewResult, carved_result
from manitwin.models.generators.lift.posed_carving import carve_posed
from manitwin.models.generators.protocol import PhotoView

LONG_SHARE = 0.5
"""Minimum length, over the longest side, of a template's side that determines its size; shorter sides are less certain."""


def have_poses(views: Sequence[PhotoView]) -> bool:
    """Tell whether the cameras of all photos are stated."""
    return all(view.pose is not None for view in views)


def carve_posed_views(views: Sequence[PhotoView], unit_m: float | None) -> MultiViewResult:
    """Carve the object in the photos; ``unit_m`` is the poses' unit in metres. Raises Rejected as ``carve_posed``."""
    carved, longest = _carve_views(views)
    made = carved_result(carved, f"carved out of {len(views)} photos with stated cameras")
    if unit_m is None:
        return made
    return replace(made, part=scaled_part(made.part, longest * unit_m), metric=True)


def scale_to_poses(made: MultiViewResult, views: Sequence[PhotoView], unit_m: float) -> MultiViewResult:
    """Return a fitted template scaled to the size that the visual hull allows.

    A hull is at least as wide as the object, so the longer side with the smallest ratio determines the size. Raises Rejected
    as ``carve_posed``.
    """
    carved, longest = _carve_views(views)
    hull = upright_extents(longest * unit_m * carved.surface.vertices[:, [0, 2, 1]])
    own = upright_extents(np.asarray(made.part.vertices))
    factor = float((hull / own)[own >= LONG_SHARE * own.max()].min())
    known = None if made.known is None else made.known.scaled(factor)
    return replace(made, part=scaled_part(made.part, factor), known=known, metric=True)


def scaled_part(part: trimesh.Trimesh, factor: float) -> trimesh.Trimesh:
    """Return a scaled copy of a mesh."""
    scaled = part.copy()
    scaled.apply_scale(factor)
    return scaled


def _carve_views(views: Sequence[PhotoView]) -> tuple[CarvedSolid, float]:
    cameras: list[PosedCamera] = [view.pose for view in views if view.pose is not None]
    return carve_posed([(view.name, view.rgba) for view in views], cameras, [view.turn_deg or 0.0 for view in views])
