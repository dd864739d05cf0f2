"""Solids of revolution and boxes from silhouettes."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from manitwin.models.generators.lift.silhouette import Silhouette, rotate_upright, upright_transform
from manitwin.models.generators.lift.surface import LiftedSurface

SIDES = 64
_RINGS = 56
_BROAD_BASE = 0.85  # a base this wide relative to the body is cut there if that removes at most 6 % of the length
_EDGE = 0.97  # texture is sampled within this share of the radius
DEPTH_SHARE = 0.4  # of the shorter side: one photo does not show the depth of a box seen from the front
_AT_AXIS_PX = 1.5  # half width of the band around the axis
_STEPS = 24
_INSET = 0.02


def profile(silhouette: Silhouette) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows (K,) of the upright mask and the radius (K,) at each, top to bottom, in pixels."""
    turned = rotate_upright(silhouette.mask, silhouette.axis_tilt_deg)
    rows = rows_on_axis(turned, silhouette.axis_column_px)
    body = turned[rows[0] : rows[-1] + 1]
    column = round(silhouette.axis_column_px)
    left, right = body[:, :column].sum(axis=1), body[:, column:].sum(axis=1)
    # where the halves differ the narrower one is used, because a part on one side only is not part of the solid
    radii = np.where(np.abs(left - right) > 0.15 * (left + right), np.minimum(left, right), (left + right) / 2.0)
    return np.arange(rows[0], rows[-1] + 1, dtype=float), gaussian_filter1d(radii, 1.2, mode="nearest")


def rows_on_axis(mask: np.ndarray, column_px: float) -> np.ndarray:
    """Return the rows (K,) of a mask (H, W) from the first to the last with a pixel at an upright axis in this column.

    A corner or an ear that rises beside the axis is not part of a body about it; it would become a needle at its end.
    """
    columns = np.arange(mask.shape[1])
    at_axis = np.nonzero(mask[:, np.abs(columns - column_px) <= _AT_AXIS_PX].any(axis=1))[0]
    return np.arange(at_axis[0], at_axis[-1] + 1)


def trim_caps(
    rows: np.ndarray, radii: np.ndarray, *, base_at_top: bool = False, base_share: float = 0.35
) -> tuple[np.ndarray, np.ndarray]:
    """Cut the rounded ends off a profile so that its base is a flat disc.

    A camera above or below the disc at an end sees it as an ellipse, so the last rows narrow although the solid does not.
    Both ends are cut where they narrow like a half-ellipse less than a quarter as deep as its radius; the base also where it
    has less than ``base_share`` of the radius nearby, so that round objects stand.
    """
    top = _cap_row_count(radii, base_share if base_at_top else 0.0, len(rows))
    bottom = _cap_row_count(radii[::-1], 0.0 if base_at_top else base_share, len(rows))
    return rows[top : len(rows) - bottom], radii[top : len(rows) - bottom]


def _cap_row_count(radii: np.ndarray, least_share: float, length: int) -> int:
    """Return the number of rows to cut at the start of ``radii``."""
    nearby = float(radii[: max(8, length // 4)].max())
    widest = int(np.argmax(radii[: max(8, length // 4)] >= 0.97 * nearby))
    if 2 <= widest < 0.25 * nearby:
        rows = np.arange(widest + 1)
        ellipse = nearby * np.sqrt(np.maximum(0, 1 - ((widest - rows) / (widest + 0.5)) ** 2))
        if np.abs(ellipse - radii[: widest + 1]).mean() < 0.12 * nearby:
            return min(widest, length // 6)
    if least_share == 0:
        return 0
    broad = int(np.argmax(radii >= _BROAD_BASE * nearby))
    return broad if broad <= 0.06 * length else min(int(np.argmax(radii >= least_share * nearby)), length // 6)


def revolve(silhouette: Silhouette, rows: np.ndarray, radii: np.ndarray, *, wall_px: float | None) -> LiftedSurface:
    """Revolve a profile about the silhouette's axis; ``wall_px`` hollows it from the top with a wall of that thickness.

    The surface has the axis along y at z = 0; y is minus the row of the upright mask. The photo is projected onto the front;
    the back and the inside are not visible.
    """
    rings = np.linspace(rows[0], rows[-1], _RINGS)
    outline = [(row, radius) for row, radius in zip(rings, np.interp(rings, rows, radii), strict=True)]
    least = 0.02 * radii.max()
    outline = [(row, max(radius, least)) for row, radius in outline]
    if wall_px is None:
        return _lathe(silhouette, np.array([(rings[0], 0.0), *outline, (rings[-1], 0.0)]), 0)
    inner = [(row, radius - wall_px) for row, radius in outline if row < rings[-1] - 1.5 * wall_px]
    inner = [(row, max(radius, least)) for row, radius in inner]
    loop = [(inner[-1][0], 0.0), *inner[::-1], *outline, (rings[-1], 0.0)]
    return _lathe(silhouette, np.array(loop), len(inner))


def _lathe(silhouette: Silhouette, loop: np.ndarray, inside: int) -> LiftedSurface:
    """Revolve a loop of (row, radius) from axis to axis into a closed surface, with the outside to the left of its direction.

    The first ``inside`` rings belong to the inside.
    """
    turns = 2 * np.pi * np.arange(SIDES) / SIDES
    middle = loop[1:-1]
    x = middle[:, 1:] * np.sin(turns)
    z = middle[:, 1:] * np.cos(turns)
    y = np.repeat(-middle[:, :1], SIDES, axis=1)
    ring_points = np.stack([x, y, z], -1).reshape(-1, 3)
    poles = np.array([[0, -loop[0, 0], 0], [0, -loop[-1, 0], 0]])
    vertices = np.concatenate([ring_points, poles])
    ring, side = np.meshgrid(np.arange(len(middle) - 1), np.arange(SIDES), indexing="ij")
    here, there = ring * SIDES + side, ring * SIDES + (side + 1) % SIDES
    quads = np.concatenate(
        [
            np.stack([here, here + SIDES, there], -1).reshape(-1, 3),
            np.stack([there, here + SIDES, there + SIDES], -1).reshape(-1, 3),
        ]
    )
    sides = np.arange(SIDES)
    first, last = len(ring_points), len(ring_points) + 1
    top = np.column_stack([np.full(SIDES, first), sides, (sides + 1) % SIDES])
    low = (len(middle) - 1) * SIDES
    bottom = np.column_stack([np.full(SIDES, last), low + (sides + 1) % SIDES, low + sides])
    facing = np.tile(np.cos(turns), (len(middle), 1))
    facing[:inside] = -1.0
    facing = np.append(facing.ravel(), [-1.0, -1.0])  # a photo shows an end at a grazing angle at most
    return LiftedSurface(vertices, np.concatenate([quads, top, bottom]), _projected(silhouette, vertices), facing)


def _projected(silhouette: Silhouette, vertices: np.ndarray) -> np.ndarray:
    """Return the texture coordinates of the photo seen along z."""
    height, width = silhouette.mask.shape
    upright = np.column_stack([silhouette.axis_column_px + _EDGE * vertices[:, 0], -vertices[:, 1]])
    matrix = np.vstack([upright_transform(height, width, silhouette.axis_tilt_deg), [0, 0, 1]])
    pixels = np.column_stack([upright, np.ones(len(upright))]) @ np.linalg.inv(matrix).T
    return np.column_stack([(pixels[:, 0] + 0.5) / width, 1 - (pixels[:, 1] + 0.5) / height])


def make_box(silhouette: Silhouette, *, depth_share: float) -> LiftedSurface:
    """Make a box with the fitted rectangle as its front; its depth is ``depth_share`` of the shorter side.

    The sides continue the colours of the front's edges.
    """
    corners = _order_corners(silhouette.corners)
    width = float(np.linalg.norm(corners[1] - corners[0]))
    height = float(np.linalg.norm(corners[3] - corners[0]))
    depth = depth_share * min(width, height)
    grid = np.linspace(0, 1, _STEPS + 1)
    u, v = np.meshgrid(grid, grid)
    flat_uv = np.column_stack([u.ravel(), v.ravel()])
    count = len(flat_uv)
    x, y = (flat_uv[:, 0] - 0.5) * width, (0.5 - flat_uv[:, 1]) * height
    front = np.column_stack([x, y, np.full(count, depth / 2)])
    back = np.column_stack([x, y, np.full(count, -depth / 2)])
    cell = np.arange(_STEPS)
    row, column = (g.ravel() for g in np.meshgrid(cell, cell, indexing="ij"))
    a = row * (_STEPS + 1) + column
    faces = np.concatenate(
        [np.column_stack([a, a + _STEPS + 1, a + 1]), np.column_stack([a + 1, a + _STEPS + 1, a + _STEPS + 2])]
    )
    rim = _front_edges()
    p, q = rim[:, 0], rim[:, 1]
    walls = np.concatenate([np.column_stack([q, p, p + count]), np.column_stack([q, p + count, q + count])])
    inset = _INSET + (1 - 2 * _INSET) * flat_uv
    pixels = corners[0] + inset[:, :1] * (corners[1] - corners[0]) + inset[:, 1:] * (corners[3] - corners[0])
    shape = silhouette.mask.shape
    uv = np.column_stack([(pixels[:, 0] + 0.5) / shape[1], 1 - (pixels[:, 1] + 0.5) / shape[0]])
    return LiftedSurface(
        np.concatenate([front, back]),
        np.concatenate([faces, faces[:, ::-1] + count, walls]),
        np.concatenate([uv, uv]),
        np.repeat([1.0, -1.0], count),
    )


def _order_corners(corners: np.ndarray) -> np.ndarray:
    """Return the corners top left, top right, bottom right, bottom left of the rectangle, with the top side uppermost."""
    centre = corners.mean(axis=0)
    angles = np.arctan2(corners[:, 1] - centre[1], corners[:, 0] - centre[0])
    ordered = corners[np.argsort(angles)]  # clockwise on the screen, starting from the left
    tops = [((ordered[k] + ordered[(k + 1) % 4]) / 2)[1] for k in range(4)]
    start = int(np.argmin(tops))
    return np.roll(ordered, -start, axis=0).astype(float)


def _front_edges() -> np.ndarray:
    """Return the front's outline edges, directed counter-clockwise on the screen."""
    side, last = _STEPS + 1, _STEPS * (_STEPS + 1)
    k = np.arange(_STEPS)
    left = np.column_stack([k * side, (k + 1) * side])
    bottom = np.column_stack([last + k, last + k + 1])
    right = np.column_stack([(k + 1) * side + _STEPS, k * side + _STEPS])
    top = np.column_stack([k + 1, k])
    return np.concatenate([left, bottom, right, top])
