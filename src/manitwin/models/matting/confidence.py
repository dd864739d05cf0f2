"""The confidence in a mask, measured on the photo that it was cut from."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy import ndimage

from manitwin.models.matting.background import Background, connected_to, length
from manitwin.models.matting.ground_inside import ground_inside
from manitwin.models.matting.hard_shadow import PENUMBRA_PX, edge_width_px
from manitwin.models.matting.outline import dilated, disk, eroded, opened
from manitwin.models.matting.segmentation import Segmentation
from manitwin.models.matting.shade_strips import shade_strips

MOST_ZOOM = 1.6  # beyond that a photo's blur, not its pixels, says how fine its outlines are
WIDER = 1.3  # than the photo's own blur: its edges differ by 1.2 times, as made photos show
FRAME_EDGE = 5.0  # L*a*b* per pixel: an edge in focus of an object, not shading

LOW_SCORE = 0.5
"""A score below it is a doubt by itself."""


@dataclass(frozen=True)
class MatteScores:
    """Each in [0, 1]; 1 is best.

    ``on_edges`` share of the outline that lies on an edge of the photo; ``crisp`` how sharp it is against the object's own
    strong edges; ``separable`` how well the colours just inside and just outside the outline differ from the background's
    (Youden's J); ``complete`` nothing else stands out of the background; ``uncut`` how little of it the image border cuts;
    ``stable`` agreement of two independent opinions, or how well the mask explains every edge in focus; ``whole`` little lies
    outside the largest connected part; ``plain`` how uniform the background is; ``outermost`` share of the outline with no edge
    beyond it, in what passes for shade, that is nearly as sharp; ``sharply_bounded`` how little of it is as soft as a shadow's
    edge with shade inside; ``unshaded`` how little along it has the ground's own tint, dimmed, where the rest has other
    colours; ``solid`` how little of it, enclosed by the rest, has the ground's own tint: a hole may be filled; ``thick`` how
    small its outline is against its area: a third of a pixel off all around is 5 % of a thin thing.
    """

    on_edges: float
    crisp: float
    separable: float
    complete: float
    uncut: float
    stable: float
    whole: float
    plain: float
    outermost: float
    sharply_bounded: float
    unshaded: float
    solid: float
    thick: float

    @property
    def of_one_whole(self) -> bool:
        """Whether nothing speaks against one whole thing: that it falls apart, others stand beside it, or the frame cuts it."""
        return min(self.complete, self.whole, self.uncut) >= LOW_SCORE


def score(segmentation: Segmentation, *, zoom: float = 1.0, share: np.ndarray | None = None) -> MatteScores:
    """Score a mask that is not empty; ``zoom`` is the photo's size over the mask's, ``share`` as for ``ground_inside``."""
    mask, background = segmentation.mask, segmentation.background
    outline = mask & ~eroded(mask, 1)
    border = border_of(mask.shape)
    sharpest = cv2.dilate(segmentation.gradient, disk(3))
    free = outline & ~border
    typical = max(float(np.percentile(sharpest[mask], 75)), 1e-6)
    on_edges = float((sharpest[free] > 1.6 * segmentation.edge_threshold).mean()) if free.any() else 0.0
    reach = max(4, round(0.015 * max(mask.shape)))
    inside = mask & ~eroded(mask, reach)
    gap = max(
        4, round(0.03 * max(mask.shape))
    )  # light bounced off the object, and a coarse JPEG, tint what is next to it
    outside = dilated(mask, reach + gap) & ~dilated(mask, gap) & ~segmentation.shadow & ~background.shade
    hit = float((background.distance[inside] > 4).mean())
    false = float((background.distance[outside] > 4).mean()) if outside.sum() > 0.5 * outline.sum() else 0.0
    _, _, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    areas = stats[1:, cv2.CC_STAT_AREA]
    strips = shade_strips(background, mask, segmentation.gradient)
    outlined, beyond = _in_focus(segmentation, outline)
    # two opinions differ, and one has all edges in focus for its outline and leaves none beside it
    settled = _ramp(outlined, 0.92, 0.99) * _ramp(-beyond, -0.3, -0.05)
    return MatteScores(
        on_edges=_ramp(on_edges, 0.4, 0.9),
        crisp=_ramp(float(np.median(sharpest[free])) / typical if free.any() else 0.0, 0.15, 0.5),
        separable=_ramp(hit - false, 0.1, 0.7),
        complete=_ramp(1 - _left_over(segmentation) / mask.sum(), 0.3, 0.9),
        uncut=_ramp(-float((mask & border).sum()) / 2 / _longest(mask), -0.06, -0.01),
        stable=max(_ramp(segmentation.agreement, 0.6, 0.95), settled),
        whole=_ramp(float(areas.max() / areas.sum()), 0.9, 1.0),
        plain=_ramp(-background.noise_lab - 20 * background.unexplained, -12, -3),
        outermost=_ramp(-_overshadowed(segmentation, outline), -0.25, -0.05),
        sharply_bounded=_ramp(-_softly_bounded(segmentation, outline), -0.4, -0.15),
        unshaded=_ramp(-float((strips.shadow | strips.doubtful).sum() / mask.sum()), -0.05, -0.01),
        solid=_ramp(
            -ground_inside(background, mask, segmentation.gradient, segmentation.edge_threshold, share), -0.008, -0.002
        ),
        thick=_ramp(-outline.sum() / mask.sum() / min(zoom, MOST_ZOOM), -0.25, -0.12),
    )


def border_of(shape: tuple[int, ...]) -> np.ndarray:
    """Return which pixels (H, W) of a picture are its outermost two."""
    border = np.ones(shape, bool)
    border[2:-2, 2:-2] = False
    return border


def frame_cause(background: Background, gradient: np.ndarray) -> str | None:
    """Return what sharp edges across the image's frame mean: ``uncut`` an object cut off, ``plain`` a cluttered scene.

    None where the frame has no more of them than a wall that meets a table. A frame nearly half of which has one colour
    shows a plain background, and what interrupts it is cut off.
    """
    lab = cv2.GaussianBlur(background.lab, (0, 0), 1.5)
    colours, steepest = _along_frame(lab), _along_frame(gradient)
    crossings = int((np.diff((steepest > FRAME_EDGE).astype(int)) == 1).sum())
    if crossings < 4:
        return None
    weights = np.array([0.5, 1.0, 1.0])  # lightness varies along a background more than colour does
    near = [np.linalg.norm((colours - colour) * weights, axis=1) < 8 for colour in colours[::8]]
    return "uncut" if max(float(same.mean()) for same in near) > 0.4 else "plain"


def _along_frame(picture: np.ndarray) -> np.ndarray:
    inner = picture[2:-2, 2:-2]
    return np.concatenate([inner[0], inner[1:, -1], inner[-1, -2::-1], inner[-2:0:-1, 0]])


def _overshadowed(segmentation: Segmentation, outline: np.ndarray) -> float:
    """Return the share of the outline that has an edge beyond it, in the shade beside it, at least 0.7 times as sharp.

    A shadow's own edge is softer than the outline of what casts it, so a sharp one is the rim of a grey or clear part. A
    shadow with a visible edge was judged by more than that, and does not count.
    """
    mask, gradient = segmentation.mask, segmentation.gradient
    distance, nearest = ndimage.distance_transform_edt(~mask, return_indices=True)
    shade = (segmentation.shadow | segmentation.background.shade) & ~dilated(segmentation.hard, 6)
    beside = shade & (distance > 5) & (distance < 0.1 * max(mask.shape))
    beyond = np.zeros(mask.shape, np.float32)
    np.maximum.at(beyond, (nearest[0][beside], nearest[1][beside]), gradient[beside])
    sharper = cv2.dilate(beyond, disk(3)) > 0.7 * cv2.dilate(gradient, disk(3))
    return float(sharper[outline].mean())


def _softly_bounded(segmentation: Segmentation, outline: np.ndarray) -> float:
    """Return the share of the outline where a penumbra, not an edge, leads to the background's colour, dimmed.

    That is the outline of a shadow: seen on a grey object, where nothing else tells the shadow that hangs on it. The sharper
    quarter of the outline says how wide the photo's own blur is.
    """
    inner = eroded(segmentation.mask, 5)
    if not inner.any():
        return 0.0
    distance, nearest = ndimage.distance_transform_edt(~inner, return_indices=True)
    depth = cv2.blur(length(segmentation.background.residual), (3, 3))
    width_px = edge_width_px(depth[nearest[0], nearest[1]], cv2.dilate(segmentation.gradient, disk(4)))
    at = outline & (distance < 9)
    if not at.any():
        return 0.0
    limit_px = max(PENUMBRA_PX, WIDER * float(np.percentile(width_px[at], 25)))
    soft = (width_px > limit_px) & segmentation.background.shade[nearest[0], nearest[1]]
    return float(soft[at].mean())


def _in_focus(segmentation: Segmentation, outline: np.ndarray) -> tuple[float, float]:
    """Return the share of the outline on narrow edges, and how many of those lie beside the mask, as a share of the outline."""
    mask, narrow = segmentation.mask, segmentation.narrow
    beside = dilated(mask, round(0.1 * max(mask.shape))) & ~dilated(mask, 6)
    return float(dilated(narrow, 3)[outline].mean()), float((narrow & beside).sum() / outline.sum())


def _left_over(segmentation: Segmentation) -> float:
    """Return the area of coherent things outside the mask: no background and no shadow, or a shadow with drawing in it."""
    background = segmentation.background
    away = ~dilated(segmentation.mask, 5) & ~background.seam
    limit = max(5.0, 1.5 * float(np.percentile(background.coarse_distance[background.border], 98)))
    shade = dilated(segmentation.shadow, 3) | background.shade
    things = opened(away & ~shade & (background.coarse_distance > limit), 3)
    away &= ~dilated(segmentation.mask, round(0.03 * max(away.shape)))
    edges = cv2.dilate(segmentation.gradient, disk(2))[segmentation.mask]
    sharp = max(1.6 * segmentation.edge_threshold, 0.15 * float(np.percentile(edges, 90)))
    drawn = away & eroded(segmentation.shadow, 4) & (segmentation.gradient > sharp)
    things &= ~connected_to(things, background.border)  # light that the model missed comes in from the border
    return float(things.sum() + 3 * drawn.sum())


def _longest(mask: np.ndarray) -> int:
    rows, columns = np.nonzero(mask)
    return int(max(np.ptp(rows), np.ptp(columns))) + 1


def _ramp(value: float, worst: float, best: float) -> float:
    return float(np.clip((value - worst) / (best - worst), 0, 1))
