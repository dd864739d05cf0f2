"""Rule-based segmentation of the object: all but the flooded background, without shadows and gaps, cut along edges."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy import ndimage

from manitwin.models.matting.background import Background, length, model_background, total
from manitwin.models.matting.edge_scale import edge_scale, narrow_edges
from manitwin.models.matting.hard_shadow import hard_shadow
from manitwin.models.matting.outline import (
    dilated,
    edge_threshold,
    edges,
    eroded,
    fill_small_holes,
    flood_region,
    gradient_magnitude,
    opened,
)
from manitwin.models.matting.second_opinion import MaskBounds, colour_opinion
from manitwin.models.matting.shade_strips import shade_strips
from manitwin.models.matting.shadow import cast_shadow, gaps

SAME = 0.97  # agreement above which the masks are not reconciled
BLIND = 0.6  # minimum share of the first mask that the colour model calls possible
CUT_MARGIN_PX = 16
MOSTLY_NARROW = 0.7  # share of an outline on narrow edges: an outline in focus all around belongs to an object
BALL_SHARE = 0.010  # of the longer side: the flood does not pass gaps in an outline narrower than twice this


@dataclass(frozen=True)
class Segmentation:
    """Mask (H, W) at working resolution, with the intermediate results that produced it.

    ``gradient`` is the colour gradient and ``edge_threshold`` its limit for edges. ``hard`` is the part of ``shadow`` with a
    visible edge. ``agreement`` in [0, 1] is the agreement of the surface-and-flood mask with the reconciled mask, ``colours``
    the colour opinion, and ``narrow`` are the edges in focus (``narrow_edges``).
    """

    mask: np.ndarray
    background: Background
    gradient: np.ndarray
    edge_threshold: float
    shadow: np.ndarray
    hard: np.ndarray
    agreement: float
    colours: MaskBounds
    narrow: np.ndarray

    @property
    def known_to_colours(self) -> float:
        """Share of the mask that the colour model alone calls possible."""
        return float((self.mask & dilated(self.colours.possible, 2)).sum() / max(int(self.mask.sum()), 1))


def segment(rgb: np.ndarray) -> Segmentation:
    """Segment the object in ``rgb`` (H, W, 3) uint8 at working size (about 512 px)."""
    background = model_background(rgb)
    gradient = gradient_magnitude(background.lab)
    threshold = edge_threshold(background, gradient)
    walls = edges(background, gradient, threshold)
    ball = max(3, round(BALL_SHARE * max(rgb.shape[:2])))
    frame = np.zeros(walls.shape, bool)
    frame[[0, -1]] = frame[:, [0, -1]] = True
    candidate = ~flood_region(~walls, frame, ball_px=ball, regrow_px=ball + 2)
    # strips of background colour without edges that are too narrow for the ball, e.g. between a table's edge and a shadow's
    plain = ~walls & (background.distance < 2.5)
    candidate &= ~flood_region(~candidate | plain, ~candidate, ball_px=2, regrow_px=4)
    candidate &= ~background.seam | opened(candidate, 2 * ball)  # remainders of a seam are thin lines
    narrow = narrow_edges(gradient, edge_scale(background.lab), 1.6 * threshold, dilated(candidate, 2))
    shadow = cast_shadow(background, candidate, gradient, threshold, narrow)
    seen_through = gaps(background, candidate & ~shadow, gradient, threshold)
    hard = hard_shadow(background, candidate & ~shadow & ~seen_through, gradient, narrow)
    shadow |= hard
    solid = candidate & ~shadow & ~seen_through
    first = _graph_cut(background, solid, hard, core_px=6, doubt=3.0, seed=0)
    strips = shade_strips(background, first, gradient).shadow
    if strips.any():
        hard |= strips
        shadow |= strips
        first = remove_specks(first & ~strips)
    colours = colour_opinion(rgb)
    joined, agreement = combine_opinions(first, colours, shadow | seen_through, narrow)
    second = (
        first
        if agreement > SAME
        else _graph_cut(background, joined, hard & ~joined, core_px=6, doubt=3.0, seed=0) & ~_distant_pixels(joined)
    )
    mask = shrink_to_half_contrast(background, second)
    return Segmentation(mask, background, gradient, threshold, shadow & ~mask, hard & ~mask, agreement, colours, narrow)


def combine_opinions(
    first: np.ndarray, colours: MaskBounds, shadow: np.ndarray, narrow: np.ndarray
) -> tuple[np.ndarray, float]:
    """Combine two opinions into one mask; return it with their agreement in [0, 1].

    Pixels whose colour certainly differs from the background are added, and pixels whose colour cannot differ are removed;
    between the two bounds the first mask decides. In the ``shadow`` of the first opinion, which coloured light may tint,
    colours add nothing and only lower the agreement. If the colour model calls less than ``BLIND`` of the first mask
    possible, the first mask is returned with agreement 0. Regions that colours remove inside the object stay and lower the
    agreement, because only ``gaps`` tells a hole from a label in the background's colours.
    """
    if not first.any():
        return colours.certain & ~shadow, 0.0
    inside = (first & colours.possible).sum() / first.sum()
    if inside < BLIND:
        return first, 0.0
    added = opened(colours.certain & ~first, 1)
    removed = opened(first & ~colours.possible, 1)
    empty = _open_to_outside(removed, first, dilated(narrow, 3))
    joined = (first | (added & ~shadow)) & ~empty
    differs = opened((added & ~first) | removed, 1).sum() / max(int(joined.sum()), 1)
    return joined, float(np.clip(1 - differs, 0, 1))


def _open_to_outside(regions: np.ndarray, solid: np.ndarray, near_narrow: np.ndarray) -> np.ndarray:
    """Return those ``regions`` of ``solid`` that reach its outline where the outline is not mostly on narrow edges.

    A label in the background's colours lies inside the object, and a cap in these colours has an outline in focus; a shadow
    has neither.
    """
    count, labels, stats, _ = cv2.connectedComponentsWithStats(regions.astype(np.uint8), connectivity=4)
    kept = np.zeros(regions.shape, bool)
    for index in range(1, count):
        left, top, width, height, _area = stats[index]
        box = np.s_[max(0, top - 3) : top + height + 3, max(0, left - 3) : left + width + 3]
        part = labels[box] == index
        outer = dilated(part, 2) & ~solid[box]
        if outer.any() and near_narrow[box][outer].mean() < MOSTLY_NARROW:
            kept[box] |= part
    return kept


def _distant_pixels(mask: np.ndarray) -> np.ndarray:
    return ~dilated(mask, 3)


def _graph_cut(
    background: Background, solid: np.ndarray, shadow: np.ndarray, *, core_px: int, doubt: float, seed: int
) -> np.ndarray:
    """Refine the outline with GrabCut (Rother, Kolmogorov, Blake 2004) on the colour residuals.

    Only pixels within ``core_px`` of the outline can change sides, or within four times that if their distance to the
    background is less than ``doubt``; those start as background. A known ``shadow`` without its rim is fixed as background,
    so that its colours are learned as background.
    """
    if not solid.any():
        return solid
    depth = cv2.distanceTransform(solid.astype(np.uint8), cv2.DIST_L2, 5)
    labels = np.full(solid.shape, cv2.GC_BGD, np.uint8)
    labels[dilated(solid, 2)] = cv2.GC_PR_BGD
    labels[solid] = cv2.GC_PR_FGD
    doubtful = background.distance < doubt
    labels[solid & doubtful & (depth <= 4 * core_px)] = cv2.GC_PR_BGD
    labels[solid & (depth > core_px) & (~doubtful | (depth > 4 * core_px))] = cv2.GC_FGD
    labels[eroded(shadow, 1)] = cv2.GC_BGD
    if not ((labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD)).any():
        return np.zeros(solid.shape, bool)
    # amplified residuals: the background becomes one tight cluster at mid-grey, independent of the lighting
    image = np.clip(128 + 3 * background.residual * [0.7, 1, 1], 0, 255).astype(np.uint8)
    cv2.setRNGSeed(seed)
    box = _around(labels != cv2.GC_BGD, CUT_MARGIN_PX)  # distant background adds no information
    near = labels[box]
    cv2.grabCut(
        np.ascontiguousarray(image[box]),
        near,
        (0, 0, 1, 1),
        np.zeros((1, 65)),
        np.zeros((1, 65)),
        3,
        cv2.GC_INIT_WITH_MASK,
    )
    mask = np.zeros(solid.shape, bool)
    mask[box] = (near == cv2.GC_FGD) | (near == cv2.GC_PR_FGD)
    return remove_specks(mask)


def _around(mask: np.ndarray, margin_px: int) -> tuple[np.ndarray, np.ndarray]:
    """Return an index of the rows and columns within a margin of any row or column that ``mask`` touches.

    Rows and columns between distant pieces are left out to save memory: the graph takes 200 bytes a pixel.
    """
    reach = np.ones(2 * margin_px + 1)
    near = [ndimage.binary_dilation(mask.any(axis), reach) for axis in (1, 0)]
    return np.ix_(*near)


def shrink_to_half_contrast(background: Background, mask: np.ndarray, band_px: int = 8) -> np.ndarray:
    """Move the outline inward to where a pixel is half object.

    The background colour B is known, and the object's colour F is that of the nearest pixel well inside. The share of the
    object is alpha = (I - B) . (F - B) / |F - B|^2, the compositing equation (Porter and Duff 1984) solved for alpha. Only
    pixels within ``band_px`` of the outline can be removed, from outside inward.
    """
    depth = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5)
    thickest = cv2.dilate(depth, np.ones((2 * band_px + 1, 2 * band_px + 1), np.uint8))
    inner = mask & (depth >= np.minimum(band_px, 0.8 * thickest))
    if not inner.any():
        return mask
    nearest = ndimage.distance_transform_edt(~inner, return_distances=False, return_indices=True)
    residual = cv2.GaussianBlur(background.residual, (0, 0), 0.6)
    own = residual[nearest[0], nearest[1]]
    share = total(residual * own) / np.maximum(total(own**2), 1e-6)
    visible = length(own) > 8 * max(background.noise_lab, 0.5)
    # a mixed pixel lies on the line between B and F; a rim of another colour does not and is kept
    off_line = length(residual - share[..., None] * own)
    mixed = off_line < 0.12 * length(own) + 4 * max(background.noise_lab, 0.5)
    thin = mask & ~inner & visible & mixed & (share < 0.5)
    reached = ~mask
    for _ in range(band_px):
        reached |= dilated(reached, 1) & thin
    return remove_specks(mask & ~reached)


def remove_specks(mask: np.ndarray) -> np.ndarray:
    """Remove pieces below 0.05 % of the picture or 2 % of the largest piece, and fill small holes."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    areas = stats[:, cv2.CC_STAT_AREA].copy()
    areas[0] = 0
    if areas.max() == 0:
        return mask
    kept = (areas > max(5e-4 * mask.size, 0.02 * areas.max()))[labels]
    return fill_small_holes(kept)
