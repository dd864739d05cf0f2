"""Carve a solid out of several outlines of one object, seen from about its own height at known turns about the vertical.

The visual hull (Laurentini 1994): what lies within every outline. Photos are scaled to one height; where the axis that the
turns are about stands in each is found from the outlines, for the hull must fill all of them. Two outlines at a right angle say
nothing of the corners between them: there each level is an ellipse over both widths, or nearly their rectangle for a boxy thing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from manifold3d import Manifold
from scipy import ndimage

from manitwin.errors import Rejected
from manitwin.models.generators.lift.hint import ShapeHint
from manitwin.models.generators.lift.surface import LiftedSurface, from_manifold, normalised, stood, to_manifold
from manitwin.models.generators.lift.texture import Crop, crop_object

HEIGHT_PX = 128
CELLS = 64  # of the grid along the height or the widest side
LEAST_COVERED = 0.93
"""Share of an outline that the common hull must fill; set on rendered templates: right turns fill 0.95 and more of all."""
WIDTH_SPREAD = 0.06  # of round things' outlines, seen by different lenses
OFFSETS = 21  # places of the axis tried in each photo
OFFSET_SHARE = 0.25  # of the outline's width, to each side
ROUND_POWER, USUAL_POWER, BOXY_POWER = 2.0, 4.0, 8.0  # of the superellipse at each level (Barr 1981)
LEAST_CROSSING = 0.3
"""The sine of the widest angle between two photos' directions, below which they say the same."""
SIMPLER_CELLS = 0.15  # how far the surface may move to have fewer faces
_BASE_CUTS = (0.0, 0.01, 0.02, 0.04, 0.06, 0.1)
LEAST_TIP_DEG = 5.0


@dataclass(frozen=True)
class Outline:
    """One photo: its crop, the outline ``(HEIGHT_PX, W) bool`` cut to its box, and the axis' place in it, px from the left."""

    name: str
    crop: Crop
    mask: np.ndarray
    turn_deg: float
    axis_px: float

    def across(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the picture's column of points; x to the right and y away from the viewer of the first photo, pixels."""
        angle = np.deg2rad(self.turn_deg)
        return np.asarray(self.axis_px + x * np.cos(angle) + y * np.sin(angle))


@dataclass(frozen=True)
class Carved:
    """A solid from several photos, at rest, longest side 1 (see ``Lifted``); ``covered`` says how much of each outline it fills.

    ``to_pixels (4, 4)`` takes the surface's points to x, y, and height in pixels of the outlines.
    """

    surface: LiftedSurface
    outlines: tuple[Outline, ...]
    covered: tuple[float, ...]
    to_pixels: np.ndarray


def power_of(hint: ShapeHint) -> float:
    """Return the power of the superellipse that a thing's cross-sections are where only two directions are seen."""
    return ROUND_POWER if hint.round else BOXY_POWER if hint.boxy else USUAL_POWER


def are_crossing(turns_deg: Sequence[float]) -> bool:
    """Tell whether two of the directions differ by enough to say something of the depth; the opposite one says nothing."""
    return bool(np.abs(np.sin(np.deg2rad(np.subtract.outer(turns_deg, turns_deg)))).max() >= LEAST_CROSSING)


def carve(
    photos: Sequence[tuple[str, np.ndarray]], turns_deg: Sequence[float], *, power: float = USUAL_POWER
) -> Carved:
    """Carve what matted ``photos`` (name, ``(H, W, 4) uint8``) show from ``turns_deg`` about the vertical, counter-clockwise.

    ``power`` is that of the superellipse at each level where only two directions are seen.
    Raises Rejected ``generator_failed`` naming the photo that does not go with the others.
    """
    first = [_outline(name, rgba, turn) for (name, rgba), turn in zip(photos, turns_deg, strict=True)]
    outlines = _placed(first)
    covered = _covered(outlines)
    if min(covered) < LEAST_COVERED:
        raise Rejected("generator_failed", _told(outlines, covered), "generate")
    field, cell, origin = _field(outlines, power)
    solid = _level_set(field, cell, origin)
    mesh = solid.to_mesh()
    vertices = np.asarray(mesh.vert_properties, float)[:, :3]
    # x right, height up, towards the viewer: the lifted frame
    frame = vertices[:, [0, 2, 1]] * [1, 1, -1]
    empty = np.zeros((len(vertices), 2)), np.zeros(len(vertices))
    surface = from_manifold(to_manifold(LiftedSurface(frame, np.asarray(mesh.tri_verts, np.int64), *empty)))
    standing = stood(surface, LEAST_TIP_DEG, _BASE_CUTS) or surface
    rest = normalised(standing)
    low, high = standing.vertices.min(axis=0), standing.vertices.max(axis=0)
    size = float((high - low).max())
    to_pixels = np.diag([size, size, size, 1.0])
    to_pixels[:3, 3] = (low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2
    return Carved(rest, tuple(outlines), tuple(round(share, 4) for share in covered), to_pixels)


def _outline(name: str, rgba: np.ndarray, turn_deg: float) -> Outline:
    crop = crop_object(rgba, 3 * HEIGHT_PX)
    rows, columns = np.nonzero(crop.mask.any(axis=1))[0], np.nonzero(crop.mask.any(axis=0))[0]
    box = crop.mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1].astype(np.float32)
    width = max(3, round(box.shape[1] * HEIGHT_PX / box.shape[0]))
    mask = cv2.resize(box, (width, HEIGHT_PX), interpolation=cv2.INTER_AREA) > 0.5
    return Outline(name, crop, mask, turn_deg % 360.0, (width - 1) / 2)


def same_from_every_side(photos: Sequence[tuple[str, np.ndarray]]) -> bool:
    """Tell whether all outlines are about the same one, and their own mirror images: those of a round thing are."""
    masks = [_outline(name, rgba, 0.0).mask for name, rgba in photos]
    widths = [mask.shape[1] for mask in masks]
    if max(widths) > (1 + WIDTH_SPREAD) * min(widths):
        return False
    size = (min(widths), HEIGHT_PX)
    flat = [cv2.resize(mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0 for mask in masks]
    others = [flat[0][:, ::-1], *flat[1:]]
    return min(float((flat[0] & other).sum() / (flat[0] | other).sum()) for other in others) > LEAST_COVERED


def _placed(outlines: list[Outline]) -> list[Outline]:
    """Return the outlines with the axis where their hull fills them best; the first two that cross fix it."""
    fixed = [outlines[0]]
    rest = sorted(outlines[1:], key=lambda o: -abs(np.sin(np.deg2rad(o.turn_deg - outlines[0].turn_deg))))
    for number, outline in enumerate(rest):
        crossing = abs(np.sin(np.deg2rad(outline.turn_deg - outlines[0].turn_deg))) > LEAST_CROSSING
        if number == 0 and crossing:
            fixed.append(outline)
            continue
        reach = OFFSET_SHARE * outline.mask.shape[1]
        tried = [
            Outline(outline.name, outline.crop, outline.mask, outline.turn_deg, outline.axis_px + shift)
            for shift in np.linspace(-reach, reach, OFFSETS)
        ]
        middle = (outline.mask.shape[1] - 1) / 2
        fixed.append(max(tried, key=lambda o: (round(min(_covered([*fixed, o])), 2), -abs(o.axis_px - middle))))
    return [next(o for o in fixed if o.name == outline.name and o.mask is outline.mask) for outline in outlines]


def _grid(outlines: Sequence[Outline], cells: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return the coordinates (X, Y), heights (Z) and the cell of a grid that holds everything."""
    half = max(max(o.axis_px, o.mask.shape[1] - 1 - o.axis_px) for o in outlines) + 3
    cell = max(HEIGHT_PX, 2 * half) / cells
    across = np.arange(-half, half + cell, cell)
    x, y = np.meshgrid(across, across, indexing="ij")
    return x, y, np.arange(-2 * cell, HEIGHT_PX + 2 * cell, cell), cell


def _covered(outlines: Sequence[Outline]) -> list[float]:
    """Return for each outline how much of it the common hull fills."""
    x, y, heights, _ = _grid(outlines, CELLS)
    rows = np.round(HEIGHT_PX - 1 - heights).astype(int)
    valid = (rows >= 0) & (rows < HEIGHT_PX)
    inside = np.ones((len(rows), *x.shape), bool)
    columns = [np.round(o.across(x, y)).astype(int) for o in outlines]
    for outline, column in zip(outlines, columns, strict=True):
        within = (column >= 0) & (column < outline.mask.shape[1])
        picked = outline.mask[np.clip(rows, 0, HEIGHT_PX - 1)][:, np.clip(column, 0, outline.mask.shape[1] - 1)]
        inside &= picked & within & valid[:, None, None]
    shares = []
    for outline, column in zip(outlines, columns, strict=True):
        filled = np.zeros((len(rows), outline.mask.shape[1]), bool)
        z, i, j = np.nonzero(inside)
        filled[z, column[i, j]] = True
        # a cell is wider than a pixel, and one that the outline cuts may be left out
        filled = ndimage.binary_dilation(ndimage.binary_closing(filled, np.ones((1, 5))), np.ones((1, 5)))
        wanted = outline.mask[np.clip(rows, 0, HEIGHT_PX - 1)] & valid[:, None]
        shares.append(float((filled & wanted).sum() / max(1, wanted.sum())))
    return shares


def _told(outlines: Sequence[Outline], covered: Sequence[float]) -> str:
    """Say which photo does not go with the others: the one without which they agree."""
    remedy = "check its turn (degrees, counter-clockwise from above), that it shows the same thing whole, and from its height"
    if len(outlines) > 2:
        without = [min(_covered([*outlines[:k], *outlines[k + 1 :]])) for k in range(len(outlines))]
        worst = int(np.argmax(without))
        if without[worst] >= LEAST_COVERED:
            return f"{outlines[worst].name}: its outline does not go with those of the other photos; {remedy}"
    names = ", ".join(outline.name for outline in outlines)
    return f"{names}: these outlines are not of one thing at these turns (their hull fills {min(covered):.0%} of one); {remedy}"


def _field(outlines: Sequence[Outline], power: float) -> tuple[np.ndarray, float, np.ndarray]:
    """Return how far inside each node of a grid (X, Y, Z) is, its cell and its first node, pixels."""
    x, y, heights, cell = _grid(outlines, CELLS)
    row = (HEIGHT_PX - 1 - heights).astype(np.float32)
    directions = {round(o.turn_deg % 180.0) for o in outlines}
    angles = sorted(directions)
    crossed = len(directions) == 2 and abs(abs(angles[1] - angles[0]) - 90) < 20
    hull = np.full((*x.shape, len(heights)), np.inf, np.float32)
    powers = np.zeros_like(hull)
    for outline in outlines:
        column = outline.across(x, y).astype(np.float32)
        at_column = np.repeat(column.reshape(-1, 1), len(row), axis=1)
        at_row = np.repeat(row[None], column.size, axis=0)
        distance = _sampled(_signed_distance(outline.mask), at_column, at_row).reshape(hull.shape)
        hull = np.minimum(hull, distance)
        relative = _sampled(_from_middle(outline.mask), at_column, at_row, outside=2.0).reshape(hull.shape)
        powers = np.maximum(powers, 0) + relative**power / sum(
            round(o.turn_deg % 180.0) == round(outline.turn_deg % 180.0) for o in outlines
        )
    if crossed:
        # the ellipse's level as a length: a cell's worth of slope at the outline
        scale = 0.5 * float(np.mean([o.mask.sum() / HEIGHT_PX for o in outlines]))
        hull = np.minimum(hull, scale * (1 - powers ** np.float32(1 / power)))
    smooth = ndimage.gaussian_filter(np.clip(hull, -3 * cell, 3 * cell), 0.7)
    for side in (smooth[0], smooth[-1], smooth[:, 0], smooth[:, -1], smooth[:, :, 0], smooth[:, :, -1]):
        side[...] = -cell
    return smooth, cell, np.array([x[0, 0], y[0, 0], heights[0]])


def _signed_distance(mask: np.ndarray) -> np.ndarray:
    padded = np.pad(mask, 12)
    inside = cv2.distanceTransform(padded.astype(np.uint8), cv2.DIST_L2, 5)
    outside = cv2.distanceTransform((~padded).astype(np.uint8), cv2.DIST_L2, 5)
    return np.where(padded, inside - 0.5, 0.5 - outside).astype(np.float32)


def _from_middle(mask: np.ndarray) -> np.ndarray:
    """Return how far each pixel is from the middle of its run of a row: 0 there, 1 at its ends, 2 outside."""
    padded = np.pad(mask, 12)
    found = np.full(padded.shape, 2.0, np.float32)
    steps = np.diff(np.pad(padded, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    for row in np.nonzero(padded.any(axis=1))[0]:
        for start, end in zip(np.nonzero(steps[row] == 1)[0], np.nonzero(steps[row] == -1)[0], strict=True):
            middle, half = (start + end - 1) / 2, (end - start) / 2
            columns = np.arange(max(0, int(start) - 6), min(padded.shape[1], int(end) + 6))
            found[row, columns] = np.minimum(found[row, columns], np.abs(columns - middle) / half)
    return found


def _sampled(image: np.ndarray, column: np.ndarray, row: np.ndarray, outside: float = -12.0) -> np.ndarray:
    return np.asarray(
        cv2.remap(image, column + 12, row + 12, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=outside)
    )


def _level_set(field: np.ndarray, cell: float, origin: np.ndarray) -> Manifold:
    """Return the solid where a field (X, Y, Z) is positive; raises Rejected where there is none."""
    values = field.tolist()
    nx, ny, nz = field.shape
    x0, y0, z0 = (float(each) for each in origin)

    def at(x: float, y: float, z: float) -> float:
        i, j, k = (x - x0) / cell, (y - y0) / cell, (z - z0) / cell
        a, b, c = int(i), int(j), int(k)
        if i < 0 or j < 0 or k < 0 or a >= nx - 1 or b >= ny - 1 or c >= nz - 1:
            return -cell
        i, j, k = i - a, j - b, k - c
        near, far = values[a], values[a + 1]
        p, q, r, s = near[b], near[b + 1], far[b], far[b + 1]
        low = (p[c] * (1 - j) + q[c] * j) * (1 - i) + (r[c] * (1 - j) + s[c] * j) * i
        high = (p[c + 1] * (1 - j) + q[c + 1] * j) * (1 - i) + (r[c + 1] * (1 - j) + s[c + 1] * j) * i
        return float(low * (1 - k) + high * k)

    bounds = [x0, y0, z0, x0 + (nx - 1) * cell, y0 + (ny - 1) * cell, z0 + (nz - 1) * cell]
    solid = Manifold.level_set(at, bounds, 1.3 * cell).simplify(SIMPLER_CELLS * cell)
    if solid.is_empty():
        raise Rejected("generator_failed", "the outlines have nothing in common; check the turns", "generate")
    return solid
