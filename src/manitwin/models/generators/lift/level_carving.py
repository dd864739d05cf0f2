"""Carving of a solid from silhouettes seen from about the object's height, at known turns about the vertical.

The result is the visual hull (Laurentini 1994), the solid within all silhouettes. Photos are scaled to the same height. The
column of the turning axis in each photo is estimated from the silhouettes, since the hull must fill all of them. Two
silhouettes at a right angle leave the corners of each level open; there the level is an ellipse over both widths, or nearly
their rectangle for a boxy object.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy import ndimage

from manitwin.errors import Rejected
from manitwin.models.generators.lift.carved_solid import CarvedSolid, carved_solid_from_field
from manitwin.models.generators.lift.pinhole import PinholeSilhouette, mean_ray_miss_px, signed_distance
from manitwin.models.generators.lift.texture import Crop, crop_object

HEIGHT_PX = 128
CELLS = 64  # grid cells along the height or the widest side
LEAST_COVERED = 0.93
"""Minimum share of a silhouette that the hull fills; on rendered templates with the right turns it is 0.95 and more for all."""
WIDTH_SPREAD = 0.06  # relative spread of the widths of a round object's silhouettes with different lenses
OFFSETS = 21  # number of axis columns tried in each photo
OFFSET_SHARE = 0.25  # of the silhouette's width, to each side
LEAST_CROSSING = 0.3
"""Minimum sine of the largest angle between the directions of two photos; below it they show the same."""
_FAR = 50.0  # camera distance in object heights at which silhouettes have no perspective


@dataclass(frozen=True)
class LevelSilhouette:
    """Silhouette of one photo: its crop, the mask ``(HEIGHT_PX, W) bool`` of its bounding box, and the column of the axis."""

    name: str
    crop: Crop
    mask: np.ndarray
    turn_deg: float
    axis_px: float

    def project_columns(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the column of points; x to the right and y away from the viewer of the first photo, in pixels."""
        angle = np.deg2rad(self.turn_deg)
        return np.asarray(self.axis_px + x * np.cos(angle) + y * np.sin(angle))

    def crop_share(self, points: np.ndarray) -> np.ndarray:
        """Return positions of points ``(N, 3)`` (x, height, z towards the first viewer) in the crop, 0 to 1 right and down."""
        rows = np.nonzero(self.crop.mask.any(axis=1))[0]
        columns = np.nonzero(self.crop.mask.any(axis=0))[0]
        scale = (rows[-1] + 1 - rows[0]) / HEIGHT_PX
        column = columns[0] + (self.project_columns(points[:, 0], -points[:, 2]) + 0.5) * scale
        row = rows[0] + (HEIGHT_PX - 0.5 - points[:, 1]) * scale
        height, width = self.crop.mask.shape
        return np.clip(np.column_stack([column / width, row / height]), 0.0, 1.0)

    def camera_directions(self, points: np.ndarray) -> np.ndarray:
        """Return the unit vectors ``(N, 3)`` from points to the camera, which is far away."""
        angle = np.deg2rad(self.turn_deg)
        return np.tile([np.sin(angle), 0.0, np.cos(angle)], (len(points), 1))

    def pinhole_silhouette(self, side_px: int) -> PinholeSilhouette:
        """Return the silhouette as a ``PinholeSilhouette`` of a distant camera, ``side_px`` high."""
        scale = side_px / HEIGHT_PX
        size = max(3, round(self.mask.shape[1] * scale)), side_px
        mask = cv2.resize(self.mask.astype(np.float32), size, interpolation=cv2.INTER_LINEAR) > 0.5
        angle = np.deg2rad(self.turn_deg)
        pose = np.array([[np.cos(angle), np.sin(angle), 0, 0], [0, 0, -1, 0], [-np.sin(angle), np.cos(angle), 0, _FAR]])
        focal = side_px * _FAR
        box = np.array([-(self.axis_px + 0.5) * scale, -side_px / 2])
        return PinholeSilhouette(signed_distance(mask), box, np.diag([focal, focal, 1.0]) @ pose, focal)


def place_silhouettes(photos: Sequence[tuple[str, np.ndarray]], turns_deg: Sequence[float]) -> list[LevelSilhouette]:
    """Return the silhouettes of matted photos (name, ``(H, W, 4) uint8``) with the axis at which the hull covers them best."""
    return _fit_axis_columns([_outline(name, rgba, turn) for (name, rgba), turn in zip(photos, turns_deg, strict=True)])


def level_cost_px(outlines: Sequence[LevelSilhouette], side_px: int) -> float:
    """Return the mean distance in pixels by which rays along all silhouettes, ``side_px`` high, miss the others' silhouettes."""
    return mean_ray_miss_px([outline.pinhole_silhouette(side_px) for outline in outlines])


def carve_level(outlines: Sequence[LevelSilhouette], power: float) -> CarvedSolid:
    """Carve a solid from placed silhouettes.

    ``power`` is the exponent of the superellipse at each level if only two directions are seen. Raises Rejected
    ``generator_failed`` naming the inconsistent photo.
    """
    covered = covered_shares(outlines)
    if min(covered) < LEAST_COVERED:
        raise Rejected("generator_failed", _describe_inconsistency(outlines, covered), "generate")
    return carved_solid_from_field(*_field(outlines, power), outlines, covered)


def _outline(name: str, rgba: np.ndarray, turn_deg: float) -> LevelSilhouette:
    crop = crop_object(rgba, 3 * HEIGHT_PX)
    rows, columns = np.nonzero(crop.mask.any(axis=1))[0], np.nonzero(crop.mask.any(axis=0))[0]
    box = crop.mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1].astype(np.float32)
    width = max(3, round(box.shape[1] * HEIGHT_PX / box.shape[0]))
    mask = cv2.resize(box, (width, HEIGHT_PX), interpolation=cv2.INTER_AREA) > 0.5
    return LevelSilhouette(name, crop, mask, turn_deg % 360.0, (width - 1) / 2)


def has_equal_silhouettes(photos: Sequence[tuple[str, np.ndarray]]) -> bool:
    """Tell whether all silhouettes are about equal, and mirror symmetric, as those of a round object are."""
    masks = [_outline(name, rgba, 0.0).mask for name, rgba in photos]
    widths = [mask.shape[1] for mask in masks]
    if max(widths) > (1 + WIDTH_SPREAD) * min(widths):
        return False
    size = (min(widths), HEIGHT_PX)
    flat = [cv2.resize(mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0 for mask in masks]
    others = [flat[0][:, ::-1], *flat[1:]]
    return min(float((flat[0] & other).sum() / (flat[0] | other).sum()) for other in others) > LEAST_COVERED


def _fit_axis_columns(outlines: list[LevelSilhouette]) -> list[LevelSilhouette]:
    """Return the silhouettes with the axis at which the hull covers them best; the first two that cross define it."""
    fixed = [outlines[0]]
    rest = sorted(outlines[1:], key=lambda o: -abs(np.sin(np.deg2rad(o.turn_deg - outlines[0].turn_deg))))
    for number, outline in enumerate(rest):
        crossing = abs(np.sin(np.deg2rad(outline.turn_deg - outlines[0].turn_deg))) > LEAST_CROSSING
        if number == 0 and crossing:
            fixed.append(outline)
            continue
        reach = OFFSET_SHARE * outline.mask.shape[1]
        tried = [
            LevelSilhouette(outline.name, outline.crop, outline.mask, outline.turn_deg, outline.axis_px + shift)
            for shift in np.linspace(-reach, reach, OFFSETS)
        ]
        middle = (outline.mask.shape[1] - 1) / 2
        fixed.append(max(tried, key=lambda o: (round(min(covered_shares([*fixed, o])), 2), -abs(o.axis_px - middle))))
    return [next(o for o in fixed if o.name == outline.name and o.mask is outline.mask) for outline in outlines]


def _grid(outlines: Sequence[LevelSilhouette], cells: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return the coordinates (X, Y), heights (Z) and the cell size of a grid that contains the object."""
    half = max(max(o.axis_px, o.mask.shape[1] - 1 - o.axis_px) for o in outlines) + 3
    cell = max(HEIGHT_PX, 2 * half) / cells
    across = np.arange(-half, half + cell, cell)
    x, y = np.meshgrid(across, across, indexing="ij")
    return x, y, np.arange(-2 * cell, HEIGHT_PX + 2 * cell, cell), cell


def covered_shares(outlines: Sequence[LevelSilhouette]) -> list[float]:
    """Return for each silhouette the share that the hull fills."""
    x, y, heights, _ = _grid(outlines, CELLS)
    rows = np.round(HEIGHT_PX - 1 - heights).astype(int)
    valid = (rows >= 0) & (rows < HEIGHT_PX)
    inside = np.ones((len(rows), *x.shape), bool)
    columns = [np.round(o.project_columns(x, y)).astype(int) for o in outlines]
    for outline, column in zip(outlines, columns, strict=True):
        within = (column >= 0) & (column < outline.mask.shape[1])
        picked = outline.mask[np.clip(rows, 0, HEIGHT_PX - 1)][:, np.clip(column, 0, outline.mask.shape[1] - 1)]
        inside &= picked & within & valid[:, None, None]
    shares = []
    for outline, column in zip(outlines, columns, strict=True):
        filled = np.zeros((len(rows), outline.mask.shape[1]), bool)
        z, i, j = np.nonzero(inside)
        filled[z, column[i, j]] = True
        # cells are wider than pixels, and cells cut by the outline may be missing
        filled = ndimage.binary_dilation(ndimage.binary_closing(filled, np.ones((1, 5))), np.ones((1, 5)))
        wanted = outline.mask[np.clip(rows, 0, HEIGHT_PX - 1)] & valid[:, None]
        shares.append(float((filled & wanted).sum() / max(1, wanted.sum())))
    return shares


def _describe_inconsistency(outlines: Sequence[LevelSilhouette], covered: Sequence[float]) -> str:
    """Return which photo is inconsistent with the others: the one without which they agree."""
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


def _field(outlines: Sequence[LevelSilhouette], power: float) -> tuple[np.ndarray, float, np.ndarray]:
    """Return the signed distance inside the hull at the nodes of a grid (X, Y, Z), its cell and its first node, in pixels."""
    x, y, heights, cell = _grid(outlines, CELLS)
    row = (HEIGHT_PX - 1 - heights).astype(np.float32)
    directions = {round(o.turn_deg % 180.0) for o in outlines}
    angles = sorted(directions)
    crossed = len(directions) == 2 and abs(abs(angles[1] - angles[0]) - 90) < 20
    hull = np.full((*x.shape, len(heights)), np.inf, np.float32)
    powers = np.zeros_like(hull)
    for outline in outlines:
        column = outline.project_columns(x, y).astype(np.float32)
        at_column = np.repeat(column.reshape(-1, 1), len(row), axis=1)
        at_row = np.repeat(row[None], column.size, axis=0)
        distance = _sampled(_signed_distance(outline.mask), at_column, at_row).reshape(hull.shape)
        hull = np.minimum(hull, distance)
        relative = _sampled(_relative_row_distance(outline.mask), at_column, at_row, outside=2.0).reshape(hull.shape)
        powers = np.maximum(powers, 0) + relative**power / sum(
            round(o.turn_deg % 180.0) == round(outline.turn_deg % 180.0) for o in outlines
        )
    if crossed:
        # converts the ellipse's level to a length, so that its slope at the outline is that of a distance
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


def _relative_row_distance(mask: np.ndarray) -> np.ndarray:
    """Return the distance of each pixel from the middle of its run in the row: 0 there, 1 at the ends, 2 outside."""
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
