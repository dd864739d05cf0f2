"""Detection of background that may be visible inside a mask: through a loop, a handle or a slot."""

from __future__ import annotations

import cv2
import numpy as np

from manitwin.models.matting.background import Background, length
from manitwin.models.matting.outline import dilated, disk, eroded, holds

LEAST_LIGHT, MOST_LIGHT = 0.3, 1.03
"""Light of enclosed background, in shade or not, over that of the background around the object."""
SAME_TINT = 0.025
"""Spread of the channels' ratios; background visible through loops and slots of composites has 0.007 to 0.022."""
SAME_CHROMA = 1.6  # L*a*b*, in addition to the background's noise
RIM = 3.5  # L*a*b*: minimum step to the surrounding pixels, along four fifths of the rim
RIM_PX = 3
MOST_HELD = 0.04  # of a region's area: a region that encloses more than this is a label with print
LEAST_SHARE = 1e-3
CERTAIN, UNEVEN = (
    0.9,
    0.05,
)  # foreground probability, spread of light: ten of ten such regions in composites were object


def enclosed_background_share(
    background: Background, mask: np.ndarray, gradient: np.ndarray, threshold: float, share: np.ndarray | None = None
) -> float:
    """Return the share of ``mask`` (H, W) bool that the rest encloses and that has the background's tint, in light or shade.

    Such a region may be a hole, or a grey part of an object on a grey background; since the photo does not tell which, it is
    a doubt. A region is the object and does not count if all networks are certain of it (``share`` (H, W), the minimum of
    their foreground probabilities) and its light is too uneven for background.
    """
    light, tint = background.light, background.tint
    same = (light > LEAST_LIGHT) & (light < MOST_LIGHT) & (tint < 4 * SAME_TINT)
    steepest = 0.25 * float(np.percentile(cv2.dilate(gradient, disk(3))[mask], 75))
    quiet = eroded(mask, RIM_PX) & (same | (background.distance < 4)) & (gradient < max(4 * threshold, steepest))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(quiet.astype(np.uint8), connectivity=4)
    total, outside = 0, ~mask
    for index in range(1, count):
        left, top, width, height, area = stats[index]
        if area < max(8, LEAST_SHARE * mask.sum()):
            continue
        box = np.s_[max(0, top - 6) : top + height + 6, max(0, left - 6) : left + width + 6]
        part = labels[box] == index
        around = dilated(part, RIM_PX + 1)
        rim = around & ~dilated(part, 1)
        residual = np.median(background.residual[box][part], 0)
        step = length(background.residual[box] - residual)
        if (
            not (around & outside[box]).any()
            and float(np.median(tint[box][part])) < SAME_TINT
            and float(np.hypot(*residual[1:])) < SAME_CHROMA + background.noise_lab
            and float(np.percentile(step[rim], 20)) > RIM
            and holds(part) < MOST_HELD * area
            and not (share is not None and share[box][part].mean() > CERTAIN and light[box][part].std() > UNEVEN)
        ):
            total += int(area)
    return total / max(int(mask.sum()), 1)
