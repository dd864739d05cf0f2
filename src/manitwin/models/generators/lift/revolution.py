"""Standing solids of revolution seen from above: elevation of the camera, profile, and cavity.

Under a parallel projection from elevation e a disc of radius r at height h is an ellipse about the projected axis, with its
centre at h cos(e), width 2 r and height 2 r sin(e). The largest body of revolution whose discs all lie within a silhouette of
half width W(v) at picture height v is therefore

r(h)^2 = min over v of  W(v)^2 + ((v - h cos(e)) / sin(e))^2,

the visual hull (Laurentini 1994) under that symmetry. Every elevation up to the true one explains the silhouette, by rounding
ends that are flat discs. If both ends are flat, the largest elevation that explains it is therefore the true one. If both
ends are round, the silhouette does not determine it; then the rim visible inside the silhouette decides, or the camera is
taken to be level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from manifold3d import Manifold
from scipy.ndimage import gaussian_filter1d, grey_opening, label, median_filter

from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.solids.shapes import lathe, union
from manitwin.models.generators.lift.primitives import rows_on_axis, trim_caps
from manitwin.models.generators.lift.residual import FitQuality, compute_fit_quality, parallel_camera
from manitwin.models.generators.lift.surface import LiftedSurface, bare_mesh, from_manifold, to_manifold

SIDES, RINGS = 64, 64
LEAST_TRIANGLES, EDGES = 3000, 48  # edges along height and width together
FLOOR_WALLS = 1.5  # thickness of a container's floor over that of its wall
ELEVATIONS_DEG = (0.0, 4.0, 8.0, 12.0, 16.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 70.0)
CORNERS_LOST = 0.02
"""Area that a flat end may lose to rounded corners, over the square of its radius."""
ENDS_APART_DEG = 25.0
LEVEL_DEG = 4.0  # flat ends in a level view allow this elevation, because corners are never quite sharp
LEAST_END_PX = 10  # a smaller end does not determine the elevation
WALL_SHARE = 0.06  # of the radius: default wall thickness of a container
LEAST_VISIBLE_RIM = 0.5  # minimum share of the rim's front edge on edges of the photo for an elevation by the rim
ROUND_ENDS_DEG = 57.0  # a silhouette whose upper end fits a steeper view may be round instead
MOUTH_SHARE = 0.6  # of the largest radius: minimum width of an opening whose rim determines the elevation
COLLAR_SHARE, COLLAR_RISE = 0.3, 0.08
"""Maximum length over the height, and minimum rise over the largest radius, of a bulge that is a pair of handles."""
_SMOOTH_SHARE = 0.012  # of the height: sigma of the Gaussian that smooths the profile
_LEAST = 0.02  # of the largest radius: minimum radius of a ring
_EDGE_ON = 0.01  # tolerance on the cosine, so that the outline itself counts as visible
_EDGE = 0.97  # texture is sampled within this share of the radius


@dataclass(frozen=True)
class RevolutionProfile:
    """Profile about a vertical axis: ``radii (K,)`` at ``heights (K,)``, upward, in pixels; the axis is at ``column_px``.

    Height h appears in row ``-(h cos(e) - z sin(e))``, where e is ``elevation_deg`` and z points towards the viewer.
    """

    heights: np.ndarray
    radii: np.ndarray
    column_px: float
    elevation_deg: float

    @property
    def angle_rad(self) -> float:
        """Elevation in radians."""
        return float(np.deg2rad(self.elevation_deg))


def half_widths(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the rows (K,), the half width (K,) of the body about its vertical axis at each, and the column of the axis.

    The axis maximizes the symmetric body; a part that sticks out on one side only (a handle) is excluded.
    """
    rows = np.nonzero(mask.any(axis=1))[0]
    filled = mask[rows]
    columns = np.nonzero(mask.any(axis=0))[0]
    best = (-1.0, 0.0, np.zeros(len(rows)))
    to_left, to_right = _runs(filled)
    for column in np.arange(columns[0] + 1, columns[-1], 0.5):
        middle = int(np.ceil(column))
        left = to_left[middle] + (column - middle + 0.5)
        right = to_right[middle] - (column - middle + 0.5)
        both = np.where((left > 0) & (right > 0), np.minimum(left, right), 0.0)
        if both.sum() > best[0]:
            apart = np.abs(left - right) > 0.08 * (left + right) + 1.5
            best = (float(both.sum()), float(column), np.where(apart | (both == 0), both, (left + right) / 2))
    kept = np.isin(rows, rows_on_axis(mask, best[1]))
    widths = gaussian_filter1d(median_filter(best[2][kept], 5, mode="nearest"), 0.8, mode="nearest")
    return rows[kept].astype(float), widths, best[1]


def _runs(filled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the lengths of the filled runs left and right of each column border in rows ``(K, W) bool``, ``(W + 1, K)`` each."""
    across = np.arange(filled.shape[1])
    empty_before = np.maximum.accumulate(np.where(filled, -1, across), axis=1)
    empty_from = np.minimum.accumulate(np.where(filled, len(across), across)[:, ::-1], axis=1)[:, ::-1]
    ends = np.zeros((len(filled), 1), dtype=np.int64)
    left, right = np.hstack([ends, across - empty_before]), np.hstack([empty_from - across, ends])
    return np.ascontiguousarray(left.T), np.ascontiguousarray(right.T)


def remove_collars(widths: np.ndarray) -> np.ndarray:
    """Return half widths (K,) without short bulges between the ends: a pair of handles looks like a collar from the side."""
    opened = grey_opening(widths, size=max(3, round(COLLAR_SHARE * len(widths))), mode="nearest")
    labels, count = label(widths - opened > COLLAR_RISE * widths.max())
    found = widths.copy()
    for number in range(1, count + 1):
        rows = np.nonzero(labels == number)[0]
        first, last = rows[0] - 3, rows[-1] + 3
        if first > 0 and last < len(widths) - 1:
            found[first : last + 1] = np.linspace(widths[first], widths[last], last - first + 1)
    return found


def largest_profile(rows: np.ndarray, widths: np.ndarray, column_px: float, elevation_deg: float) -> RevolutionProfile:
    """Return the largest body of revolution within a silhouette of half ``widths`` at picture ``rows`` (see the module)."""
    if elevation_deg <= 0:
        heights, radii = (each[::-1] for each in trim_caps(-rows, np.maximum(widths, _LEAST * widths.max())))
        return RevolutionProfile(heights, radii, column_px, 0.0)
    angle = np.deg2rad(elevation_deg)
    sine, cosine = float(np.sin(angle)), float(np.cos(angle))
    v = np.concatenate([[-rows[0] + 1.0], -rows, [-rows[-1] - 1.0]])
    squares = np.concatenate([[0.0], widths**2, [0.0]])
    heights = np.linspace(v[-1], v[0], 2 * len(rows)) / cosine
    radii = np.sqrt(np.min(squares[None] + ((v[None] - heights[:, None] * cosine) / sine) ** 2, axis=1))
    # the front of the lowest disc touches the lower end of the silhouette, the back of the highest disc the upper end
    low = heights * cosine - radii * sine
    high = heights * cosine + radii * sine
    kept = (low >= v[-1] - 0.75) & (high <= v[0] + 0.75)
    inner = np.nonzero(kept & (radii > _LEAST * radii.max()))[0]
    span = slice(inner[0], inner[-1] + 1)
    heights, radii = heights[span], radii[span]
    # ends that the hull tapers within the picture of a disc are flat discs
    first, last = _flat_end(heights, radii, sine, cosine), _flat_end(-heights[::-1], radii[::-1], sine, cosine)
    heights, radii = heights[first : len(heights) - last], radii[first : len(radii) - last]
    if len(heights) >= 16:  # trims what the hull rounds off where the end was seen less steeply
        heights, radii = (each[::-1] for each in trim_caps(heights[::-1], radii[::-1]))
    return RevolutionProfile(heights, radii, column_px, elevation_deg)


def _flat_end(heights: np.ndarray, radii: np.ndarray, sine: float, cosine: float) -> int:
    """Return the number of samples at the start that are no discs, because a larger disc behind them covers their picture."""
    front = heights * cosine - radii * sine
    covered = np.nonzero(front <= front[0] + 1.0)[0]
    return int(covered[np.argmax(radii[covered])])


def revolve_profile(
    turned: RevolutionProfile, *, wall_px: float | None = None, tubes: Sequence[Manifold] = ()
) -> LiftedSurface:
    """Revolve a profile and join ``tubes``; ``wall_px`` hollows it from the top with a wall of that thickness.

    The surface has the axis at x = ``column_px``, z = 0, in pixels; ``projected`` sets its visibility and texture
    coordinates.
    """
    heights = np.linspace(turned.heights[0], turned.heights[-1], RINGS)
    smooth = gaussian_filter1d(turned.radii, _SMOOTH_SHARE * len(turned.radii), mode="nearest")
    radii = np.maximum(np.interp(heights, turned.heights, smooth), _LEAST * turned.radii.max())
    solid = union([_upright(heights, radii, turned.column_px), *tubes])
    if wall_px is not None:
        inner = radii - wall_px
        within = (heights > heights[0] + FLOOR_WALLS * wall_px) & (inner > wall_px)
        if within.any():
            start = int(np.argmax(within))
            # extends beyond the rim, so that no film is left over the opening
            h = np.append(heights[start:], heights[-1] + wall_px)
            solid = solid - _upright(
                h, np.append(np.maximum(inner[start:], 0.5 * wall_px), inner[-1]), turned.column_px
            )
    if solid.num_tri() < LEAST_TRIANGLES:  # straight walls have few triangles, too large to represent visibility
        solid = solid.refine_to_length(float(np.ptp(heights) + 2 * radii.max()) / EDGES)
    mesh = solid.to_mesh()
    vertices = np.asarray(mesh.vert_properties, float)[:, :3]
    return from_manifold(
        to_manifold(
            LiftedSurface(
                vertices, np.asarray(mesh.tri_verts, np.int64), np.zeros((len(vertices), 2)), np.zeros(len(vertices))
            )
        )
    )


def _upright(heights: np.ndarray, radii: np.ndarray, column_px: float) -> Manifold:
    """Return a solid of revolution about the vertical of the picture: the lathe's Z is y here, and x is unchanged."""
    turned = lathe(np.column_stack([radii, heights]), sides=SIDES)
    return turned.transform([[1, 0, 0, column_px], [0, 0, 1, 0], [0, -1, 0, 0]])


def project_onto_photo(
    surface: LiftedSurface, mask_shape: tuple[int, int], elevation_deg: float, column_px: float
) -> LiftedSurface:
    """Return the surface with its visibility in the photo: ``facing`` by ray casting towards the viewer, ``uv`` by projection.

    Hidden vertices get the coordinates of their mirror image in front, for the painted colours.
    """
    height, width = mask_shape
    angle = np.deg2rad(elevation_deg)
    toward = np.array([0.0, np.sin(angle), np.cos(angle)])
    mesh = bare_mesh(surface)
    normals = np.asarray(mesh.vertex_normals)
    facing = normals @ toward
    extent = float(np.ptp(surface.vertices, axis=0).max())
    # offset sideways, not upwards, so that a rim does not see over the rim before it
    up = np.array([0.0, np.cos(angle), -np.sin(angle)])
    starts = surface.vertices + 1e-3 * extent * (normals - (normals @ up)[:, None] * up)
    hit = RayCaster(mesh).first_hits(starts, np.tile(toward, (len(starts), 1)))[1] >= 0
    facing = np.where(hit | (facing < -_EDGE_ON), -1.0, np.maximum(facing, 0.0))
    x, y, z = surface.vertices.T
    column = column_px + _EDGE * (x - column_px)
    row = -(y * np.cos(angle) - np.where(facing > 0, z, np.abs(z)) * np.sin(angle))
    uv = np.column_stack([(column + 0.5) / width, 1 - (row + 0.5) / height])
    return LiftedSurface(surface.vertices, surface.faces, uv, facing)


def projected_half_widths(turned: RevolutionProfile, rows: np.ndarray) -> np.ndarray:
    """Return the half width (K,) of the projected profile at picture ``rows``."""
    sine, cosine = float(np.sin(turned.angle_rad)), float(np.cos(turned.angle_rad))
    if sine == 0:
        return np.interp(-rows, turned.heights, turned.radii, left=0.0, right=0.0)
    away = (-rows[:, None] - turned.heights[None] * cosine) / sine
    return np.asarray(np.sqrt(np.max(np.maximum(turned.radii[None] ** 2 - away**2, 0.0), axis=1)))


def end_elevations(rows: np.ndarray, widths: np.ndarray, column_px: float) -> tuple[float, float]:
    """Return the largest elevations at which the upper and the lower end can be projections of flat discs."""
    bands = _end_band(widths), _end_band(widths[::-1])
    found = [0.0, 0.0]
    for elevation in ELEVATIONS_DEG[1:]:
        turned = largest_profile(rows, widths, column_px, elevation)
        if len(turned.heights) < 8:
            break
        lost = np.abs(widths - projected_half_widths(turned, rows))
        for k, (band, side) in enumerate(zip(bands, (lost, lost[::-1]), strict=True)):
            if side[:band].sum() <= CORNERS_LOST * band**2:
                found[k] = elevation
    return found[0], found[1]


def _end_band(widths: np.ndarray) -> int:
    """Return the number of rows from the start that show the end's disc: until the row count reaches the half width."""
    reached = np.arange(1, len(widths) + 1) >= np.maximum.accumulate(widths)
    return int(np.argmax(reached)) + 1 if reached.any() else len(widths)


def fit_elevation(
    body: np.ndarray, photo: np.ndarray, *, hollow: bool, handled: bool
) -> tuple[RevolutionProfile, FitQuality]:
    """Return the profile at the elevation that explains the photo best, and how well it does.

    ``body (H, W) bool`` is the silhouette, ``photo (H, W, 3)`` its colours; ``hollow`` opens the top; ``handled`` means that
    it may have handles on both sides. From nearby the upper end is seen less steeply than the lower one, so the mean of both
    is used if they are close.
    """
    rows, widths, column = half_widths(body)
    if handled:
        widths = remove_collars(widths)
    upper, lower = end_elevations(rows, widths, column)
    if hollow and widths[: _end_band(widths)].max() > MOUTH_SHARE * widths.max():
        both = upper  # a rim is certainly the edge of a disc, a base is often round
    elif _end_band(widths) < LEAST_END_PX:
        both = lower if lower < ROUND_ENDS_DEG else 0.0
    else:
        both = min(upper, lower) if abs(upper - lower) > ENDS_APART_DEG else (upper + lower) / 2
    both = 0.0 if both <= LEVEL_DEG else both

    def at(elevation: float) -> tuple[RevolutionProfile, FitQuality]:
        turned = largest_profile(rows, widths, column, elevation)
        mesh = bare_mesh(revolve_profile(turned, wall_px=WALL_SHARE * float(turned.radii.max()) if hollow else None))
        camera = parallel_camera((body.shape[0], body.shape[1]), elevation_deg=elevation)
        return turned, compute_fit_quality(mesh, camera, body, photo)

    tilted = at(both)
    if upper <= ROUND_ENDS_DEG or hollow or (tilted[1].edge_support or 0.0) >= LEAST_VISIBLE_RIM:
        return tilted
    return at(0.0)
