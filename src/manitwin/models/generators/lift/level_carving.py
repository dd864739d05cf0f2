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
from scipy import ndimage

from manitwin.errors import Rejected
from manitwin.models.generators.lift.carved_solid import Carved, carved_of
from manitwin.models.generators.lift.pinhole import Sight, passing_px, signed_distance
from manitwin.models.generators.lift.texture import Crop, crop_object

HEIGHT_PX = 128
CELLS = 64  # of the grid along the height or the widest side
LEAST_COVERED = 0.93
"""Share of an outline that the common hull must fill; set on rendered templates: right turns fill 0.95 and more of all."""
WIDTH_SPREAD = 0.06  # of round things' outlines, seen by different lenses
OFFSETS = 21  # places of the axis tried in each photo
OFFSET_SHARE = 0.25  # of the outline's width, to each side
LEAST_CROSSING = 0.3
"""The sine of the widest angle between two photos' directions, below which they say the same."""
_FAR = 50.0  # heights of the thing: a camera from which its outlines have no perspective


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

    def crop_share(self, points: np.ndarray) -> np.ndarray:
        """Return where points ``(N, 3)`` (x, height, z towards the first viewer) are in the crop, 0 to 1 right and down."""
        rows = np.nonzero(self.crop.mask.any(axis=1))[0]
        columns = np.nonzero(self.crop.mask.any(axis=0))[0]
        scale = (rows[-1] + 1 - rows[0]) / HEIGHT_PX
        column = columns[0] + (self.across(points[:, 0], -points[:, 2]) + 0.5) * scale
        row = rows[0] + (HEIGHT_PX - 0.5 - points[:, 1]) * scale
        height, width = self.crop.mask.shape
        return np.clip(np.column_stack([column / width, row / height]), 0.0, 1.0)

    def toward(self, points: np.ndarray) -> np.ndarray:
        """Return the unit vectors ``(N, 3)`` from points to the camera, which is far away."""
        angle = np.deg2rad(self.turn_deg)
        return np.tile([np.sin(angle), 0.0, np.cos(angle)], (len(points), 1))

    def sight(self, side_px: int) -> Sight:
        """Return the outline as a camera that is far away sees it, ``side_px`` high."""
        scale = side_px / HEIGHT_PX
        size = max(3, round(self.mask.shape[1] * scale)), side_px
        mask = cv2.resize(self.mask.astype(np.float32), size, interpolation=cv2.INTER_LINEAR) > 0.5
        angle = np.deg2rad(self.turn_deg)
        pose = np.array([[np.cos(angle), np.sin(angle), 0, 0], [0, 0, -1, 0], [-np.sin(angle), np.cos(angle), 0, _FAR]])
        focal = side_px * _FAR
        box = np.array([-(self.axis_px + 0.5) * scale, -side_px / 2])
        return Sight(signed_distance(mask), box, np.diag([focal, focal, 1.0]) @ pose, focal)


def placed_outlines(photos: Sequence[tuple[str, np.ndarray]], turns_deg: Sequence[float]) -> list[Outline]:
    """Return the outlines of matted photos (name, ``(H, W, 4) uint8``), the axis where their hull fills them best."""
    return _placed([_outline(name, rgba, turn) for (name, rgba), turn in zip(photos, turns_deg, strict=True)])


def level_cost_px(outlines: Sequence[Outline], side_px: int) -> float:
    """Return by how many pixels the rays along all outlines, scaled to one height of ``side_px``, pass outside of the others'."""
    return passing_px([outline.sight(side_px) for outline in outlines])


def carve_level(outlines: Sequence[Outline], power: float) -> Carved:
    """Carve what placed outlines show.

    ``power`` is that of the superellipse at each level where only two directions are seen.
    Raises Rejected ``generator_failed`` naming the photo that does not go with the others.
    """
    covered = covered_shares(outlines)
    if min(covered) < LEAST_COVERED:
        raise Rejected("generator_failed", _told(outlines, covered), "generate")
    return carved_of(*_field(outlines, power), outlines, covered)


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
        fixed.append(max(tried, key=lambda o: (round(min(covered_shares([*fixed, o])), 2), -abs(o.axis_px - middle))))
    return [next(o for o in fixed if o.name == outline.name and o.mask is outline.mask) for outline in outlines]


def _grid(outlines: Sequence[Outline], cells: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return the coordinates (X, Y), heights (Z) and the cell of a grid that holds everything."""
    half = max(max(o.axis_px, o.mask.shape[1] - 1 - o.axis_px) for o in outlines) + 3
    cell = max(HEIGHT_PX, 2 * half) / cells
    across = np.arange(-half, half + cell, cell)
    x, y = np.meshgrid(across, across, indexing="ij")
    return x, y, np.arange(-2 * cell, HEIGHT_PX + 2 * cell, cell), cell


def covered_shares(outlines: Sequence[Outline]) -> list[float]:
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
    remedy = (
        "check its turn (degrees, counter-clockwise from above), that it shows the same thing whole, and from its height, or"
        " take all photos from one place and turn the thing"
    )
    if len(outlines) > 2:
        without = [min(covered_shares([*outlines[:k], *outlines[k + 1 :]])) for k in range(len(outlines))]
        worst = int(np.argmax(without))
        if without[worst] >= LEAST_COVERED:
            return f"{outlines[worst].name}: its outline does not match those of the other photos; {remedy}"
    names = ", ".join(outline.name for outline in outlines)
    return f"{names}: these outlines are not of one object at these turns (their hull fills {min(covered):.0%} of one); {remedy}"


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
