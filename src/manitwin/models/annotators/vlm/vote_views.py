"""Views of a query: the object's own eight, or eight others around it in random order, with the candidates visible in each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.annotators.protocol import PointsRequest
from manitwin.models.annotators.vlm.view_pictures import read_picture
from manitwin.render.background_colors import background_for
from manitwin.render.cameras import ORBIT_FIRST_AZIMUTH_DEG, Camera, orbit_cameras
from manitwin.render.raycast import merge_parts, visibility_tolerance_m, visible_points
from manitwin.render.renderer import BACKDROP, shared_renderer

_ORDER_STREAM = 2
_HEIGHTS_MOVED = 3  # of eight: shifts the elevations between queries, so that each side is seen from different heights


@dataclass(frozen=True)
class QueryViews:
    """Pictures ``(H, W, 3) uint8``, their cameras, and the indices of the candidates visible in each."""

    pictures: tuple[np.ndarray, ...]
    cameras: tuple[Camera, ...]
    visible: tuple[tuple[int, ...], ...]

    @property
    def seen(self) -> set[int]:
        """Candidates that some view shows."""
        return {i for view in self.visible for i in view}


def own_views(request: PointsRequest) -> QueryViews:
    """Return the object's own views."""
    subject = request.subject
    return QueryViews(tuple(read_picture(path) for path in subject.views), subject.cameras, request.visible)


def views_of_vote(request: PointsRequest, vote: int, votes: int) -> QueryViews:
    """Return the views of a query: the object's own for the first query, rendered from positions between them for the others.

    Each query has its own order. Raises RendererMissing without a renderer.
    """
    if vote == 0 or not len(request.subject.cameras):
        return own_views(request)
    views = _render_between_views(request, vote, votes)
    order = np.random.default_rng([request.subject.seed, _ORDER_STREAM, vote]).permutation(len(views.cameras))
    return QueryViews(
        tuple(views.pictures[i] for i in order),
        tuple(views.cameras[i] for i in order),
        tuple(views.visible[i] for i in order),
    )


def _render_between_views(request: PointsRequest, vote: int, votes: int) -> QueryViews:
    """Render views at azimuths between the object's own, with elevations shifted by vote, and find the visible candidates."""
    subject = request.subject
    own, parts = subject.cameras, list(subject.parts)
    elevations = [float(np.degrees(np.arcsin(camera.camera_to_object[2, 2]))) for camera in own]
    first = own[0]
    longer = max(first.width_px, first.height_px) / first.height_px
    cameras = orbit_cameras(
        np.concatenate([part.vertices for part in parts]),
        fov_y_deg=float(np.rad2deg(2 * np.arctan(np.tan(first.fov_y_rad / 2) * longer))),
        size_px=round((first.width_px * first.height_px) ** 0.5),
        elevations_deg=np.roll(elevations, _HEIGHTS_MOVED * vote).tolist(),
        first_azimuth_deg=ORBIT_FIRST_AZIMUTH_DEG + 360.0 / len(own) * vote / votes,
    )
    frames = shared_renderer().render(parts, cameras)
    ground = background_for(frames)
    surface = merge_parts(parts)
    caster, tolerance_m = RayCaster(surface), visibility_tolerance_m(surface.extents)
    shown = [visible_points(request.positions_m, request.normals, camera, caster, tolerance_m) for camera in cameras]
    return QueryViews(
        tuple(frame.composited_over(BACKDROP, ground) for frame in frames),
        tuple(cameras),
        tuple(tuple(int(i) for i in np.flatnonzero(row)) for row in shown),
    )
