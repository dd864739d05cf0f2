"""Quality scores of a mask, measured on the photo from which it was cut."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy import ndimage

from manitwin.models.matting.background import Background, connected_to, length
from manitwin.models.matting.enclosed_background import enclosed_background_share
from manitwin.models.matting.hard_shadow import PENUMBRA_PX, edge_width_px
from manitwin.models.matting.outline import dilated, disk, eroded, opened
from manitwin.models.matting.segmentation import Segmentation
from manitwin.models.matting.shade_strips import shade_strips

MOST_ZOOM = 1.6  # above this the blur of the photo, not its pixels, limits the resolution of outlines
WIDER = 1.3  # times the blur of the photo; in synthetic photos edge widths differ by a factor of 1.2
FRAME_EDGE = 5.0  # L*a*b* per pixel: the gradient of an object edge in focus; shading is flatter

LOW_SCORE = 0.5
"""A score below this is a doubt by itself."""


@dataclass(frozen=True)
class MatteScores:
    """Scores of a mask, each in [0, 1]; 1 is best.

    - ``on_edges``: share of the outline that lies on an edge of the photo
    - ``crisp``: sharpness of the outline relative to the object's own strong edges
    - ``separable``: how well colours just inside and just outside the outline differ from the background's (Youden's J)
    - ``complete``: nothing else stands out of the background
    - ``uncut``: how little of the mask the image border cuts
    - ``stable``: agreement of two independent opinions, or how well the mask explains all edges in focus
    - ``whole``: share of the mask in its largest connected piece
    - ``plain``: uniformity of the background
    - ``outermost``: share of the outline without an edge of similar sharpness beyond it in what is classified as shade
    - ``sharply_bounded``: how little of the outline is as soft as a shadow's edge with shade inside
    - ``unshaded``: how little area along the outline has the background's tint, dimmed, where the rest has other colours
    - ``solid``: how little enclosed area has the background's tint; a low score means that a hole may be filled
    - ``thick``: how short the outline is relative to the area; for a thin object an error of a third of a pixel is 5 % of its
      area
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
    def is_whole_object(self) -> bool:
        """Whether the mask shows one whole object: one connected piece, no other objects, not cut by the frame."""
        return min(self.complete, self.whole, self.uncut) >= LOW_SCORE


def score(segmentation: Segmentation, *, zoom: float = 1.0, share: np.ndarray | None = None) -> MatteScores:
    """Score a non-empty mask; ``zoom`` is photo size over mask size, ``share`` is as in ``enclosed_background_share``."""
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
    )  # skip pixels tinted by light bounced off the object or by coarse JPEG compression
    outside = dilated(mask, reach + gap) & ~dilated(mask, gap) & ~segmentation.shadow & ~background.shade
    hit = float((background.distance[inside] > 4).mean())
    false = float((background.distance[outside] > 4).mean()) if outside.sum() > 0.5 * outline.sum() else 0.0
    _, _, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    areas = stats[1:, cv2.CC_STAT_AREA]
    strips = shade_strips(background, mask, segmentation.gradient)
    outlined, beyond = _in_focus(segmentation, outline)
    # although two opinions differ, the mask is settled if its outline has all edges in focus and none lie beside it
    settled = _linear_score(outlined, 0.92, 0.99) * _linear_score(-beyond, -0.3, -0.05)
    return MatteScores(
        on_edges=_linear_score(on_edges, 0.4, 0.9),
        crisp=_linear_score(float(np.median(sharpest[free])) / typical if free.any() else 0.0, 0.15, 0.5),
        separable=_linear_score(hit - false, 0.1, 0.7),
        complete=_linear_score(1 - _unmasked_object_area(segmentation) / mask.sum(), 0.3, 0.9),
        uncut=_linear_score(-float((mask & border).sum()) / 2 / _longest(mask), -0.06, -0.01),
        stable=max(_linear_score(segmentation.agreement, 0.6, 0.95), settled),
        whole=_linear_score(float(areas.max() / areas.sum()), 0.9, 1.0),
        plain=_linear_score(-background.noise_lab - 20 * background.unexplained, -12, -3),
        outermost=_linear_score(-_shaded_outline_share(segmentation, outline), -0.25, -0.05),
        sharply_bounded=_linear_score(-_softly_bounded(segmentation, outline), -0.4, -0.15),
        unshaded=_linear_score(-float((strips.shadow | strips.doubtful).sum() / mask.sum()), -0.05, -0.01),
        solid=_linear_score(
            -enclosed_background_share(background, mask, segmentation.gradient, segmentation.edge_threshold, share),
            -0.008,
            -0.002,
        ),
        thick=_linear_score(-outline.sum() / mask.sum() / min(zoom, MOST_ZOOM), -0.25, -0.12),
    )


def border_of(shape: tuple[int, ...]) -> np.ndarray:
    """Return a mask (H, W) of the outermost two pixels of a picture."""
    border = np.ones(shape, bool)
    border[2:-2, 2:-2] = False
    return border


def frame_cause(background: Background, gradient: np.ndarray) -> str | None:
    """Interpret sharp edges that cross the image frame: ``uncut`` for an object that is cut off, ``plain`` for a cluttered scene.

    Returns None if the frame has no more such edges than a wall that meets a table produces (fewer than four crossings). If
    more than 40 % of the frame has one colour, the background is plain and the edges belong to an object that is cut off.
    """
    lab = cv2.GaussianBlur(background.lab, (0, 0), 1.5)
    colours, steepest = _along_frame(lab), _along_frame(gradient)
    crossings = int((np.diff((steepest > FRAME_EDGE).astype(int)) == 1).sum())
    if crossings < 4:
        return None
    weights = np.array([0.5, 1.0, 1.0])  # lightness varies more than colour along a background
    near = [np.linalg.norm((colours - colour) * weights, axis=1) < 8 for colour in colours[::8]]
    return "uncut" if max(float(same.mean()) for same in near) > 0.4 else "plain"


def _along_frame(picture: np.ndarray) -> np.ndarray:
    inner = picture[2:-2, 2:-2]
    return np.concatenate([inner[0], inner[1:, -1], inner[-1, -2::-1], inner[-2:0:-1, 0]])


def _shaded_outline_share(segmentation: Segmentation, outline: np.ndarray) -> float:
    """Return the share of the outline with an edge beyond it, in the adjacent shade, that is at least 0.7 times as sharp.

    A shadow's edge is softer than the outline of the object that casts it, so a sharp edge there is the rim of a grey or
    transparent part. Shadows with a visible edge (``hard``) have been tested by other criteria and do not count.
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
    """Return the share of the outline where a penumbra instead of an edge leads to the dimmed background colour.

    This is the outline of a shadow. On a grey object nothing else tells an attached shadow from the object. The 25th
    percentile of the edge width along the outline estimates the blur of the photo.
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
    """Return the share of the outline on narrow edges, and the narrow edge pixels beside the mask over the outline's length."""
    mask, narrow = segmentation.mask, segmentation.narrow
    beside = dilated(mask, round(0.1 * max(mask.shape))) & ~dilated(mask, 6)
    return float(dilated(narrow, 3)[outline].mean()), float((narrow & beside).sum() / outline.sum())


def _unmasked_object_area(segmentation: Segmentation) -> float:
    """Return the area of other objects outside the mask: neither background nor shadow, or edges inside a shadow."""
    background = segmentation.background
    away = ~dilated(segmentation.mask, 5) & ~background.seam
    limit = max(5.0, 1.5 * float(np.percentile(background.coarse_distance[background.border], 98)))
    shade = dilated(segmentation.shadow, 3) | background.shade
    things = opened(away & ~shade & (background.coarse_distance > limit), 3)
    away &= ~dilated(segmentation.mask, round(0.03 * max(away.shape)))
    edges = cv2.dilate(segmentation.gradient, disk(2))[segmentation.mask]
    sharp = max(1.6 * segmentation.edge_threshold, 0.15 * float(np.percentile(edges, 90)))
    drawn = away & eroded(segmentation.shadow, 4) & (segmentation.gradient > sharp)
    # regions connected to the border are lighting that the background model missed
    things &= ~connected_to(things, background.border)
    return float(things.sum() + 3 * drawn.sum())


def _longest(mask: np.ndarray) -> int:
    """Return the longer side of a mask's bounding box in pixels."""
    rows, columns = np.nonzero(mask)
    return int(max(np.ptp(rows), np.ptp(columns))) + 1


def _linear_score(value: float, worst: float, best: float) -> float:
    """Map ``value`` linearly to [0, 1], from ``worst`` to ``best``, with clipping."""
    return float(np.clip((value - worst) / (best - worst), 0, 1))
