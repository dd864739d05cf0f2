"""The matte of a photo: which pixels are the object, how that was found, and how far it can be believed."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

import cv2
import numpy as np
from scipy import ndimage

from manitwin.errors import Rejected
from manitwin.models.matting.confidence import MatteScores, frame_cause, score
from manitwin.models.matting.outline import dilated, soft_outline, without_small_holes
from manitwin.models.matting.segmentation import Segmentation, segment

TRANSPARENT_SHARE = 0.02
PLAIN_NOISE_LAB = 4.0

_CAUSES = {
    "on_edges": "its outline does not follow edges of the photo",
    "crisp": "its outline is blurred, or a shadow hangs on it",
    "separable": "its colours are too close to the background's",
    "complete": "other things stand out of the background as much",
    "uncut": "the image border cuts it off",
    "stable": "the outline depends on where the search starts",
    "whole": "it falls apart into pieces",
    "plain": "the background is too cluttered",
    "sharply_bounded": "it is as grey as a shadow, and part of its outline as soft as one: a shadow may hang on it",
    "outermost": "what looks like its shadow has edges as sharp as its outline, so a clear or grey part of it may be lost",
}
_REMEDY = "photograph it whole on a plain surface of another colour, or give an image with an alpha channel"


@dataclass(frozen=True)
class Matte:
    """``rgba (H, W, 4) uint8``, alpha 255 on the object; ``confidence`` in [0, 1]; ``scores`` say where it comes from."""

    rgba: np.ndarray
    method: Literal["alpha", "flat_border", "grabcut"]
    confidence: float
    findings: tuple[str, ...]
    scores: dict[str, float]


def matte_photo(
    image: np.ndarray,
    name: str,
    *,
    working_side_px: int = 512,
    min_confidence: float = 0.5,
    min_area_share: float = 0.002,
    second_object_share: float = 0.12,
) -> Matte:
    """Find the object in ``image`` (H, W, 3 or 4) uint8 upright sRGB; ``name`` is used in messages only.

    A real alpha channel (more than 2 % transparent) is believed. Else the background is modelled from the border,
    flooded up to the photo's edges, and the outline settled by a graph cut: ``flat_border`` where smooth surfaces
    explain the border, ``grabcut`` where they do not and the cut decides alone.

    Raises Rejected: ``no_object``, ``several_objects``, ``low_confidence_matte``, naming cause and remedy.
    """
    if image.shape[2] == 4 and (image[..., 3] < 250).mean() > TRANSPARENT_SHARE:
        return _given_matte(image, name, min_area_share, second_object_share)
    rgb = np.ascontiguousarray(image[..., :3])
    found = segment(_scaled(rgb, working_side_px))
    if _longest_side(found.mask) < 0.5 * max(found.mask.shape) and max(rgb.shape[:2]) > 1.2 * working_side_px:
        found = segment(_scaled(rgb, 2 * working_side_px))  # a small thing is looked at again, closer
    scale = max(found.mask.shape) / max(rgb.shape[:2])
    plain = found.background.noise_lab < PLAIN_NOISE_LAB and found.background.unexplained < 0.05
    if found.mask.mean() < min_area_share:
        if not plain:
            raise Rejected(
                "low_confidence_matte", f"{name}: {_CAUSES['plain']} to tell an object from it; {_REMEDY}", "generate"
            )
        raise Rejected(
            "no_object", f"{name}: nothing stands out of the background; photograph the object larger", "generate"
        )
    scores = score(found)
    _reject_doubtful(name, scores, found, min_confidence, second_object_share)
    band = max(2, round(2 / scale))
    alpha = soft_outline(rgb, _largest(found.mask), band)
    return Matte(
        rgba=np.dstack([rgb, alpha]),
        method="flat_border" if plain else "grabcut",
        confidence=round(scores.confidence, 4),
        findings=tuple(_findings(scores, found)),
        scores={key: round(value, 4) for key, value in asdict(scores).items()},
    )


def _scaled(rgb: np.ndarray, side_px: int) -> np.ndarray:
    scale = side_px / max(rgb.shape[:2])
    return cv2.resize(rgb, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1 else rgb


def _longest_side(mask: np.ndarray) -> int:
    rows, columns = np.nonzero(mask)
    return int(max(np.ptp(rows), np.ptp(columns))) + 1 if len(rows) else 0


def _given_matte(image: np.ndarray, name: str, min_area_share: float, second_object_share: float) -> Matte:
    mask = image[..., 3] > 127
    if mask.mean() < min_area_share:
        raise Rejected("no_object", f"{name}: its alpha channel is empty; export it with the object opaque", "generate")
    _reject_several(name, mask, second_object_share)
    # specular pixels that a cut-out tool took for background are holes
    closed = _largest(without_small_holes(mask))
    alpha = np.where(closed & ~mask, 255, np.where(dilated(closed, 2), image[..., 3], 0)).astype(np.uint8)
    # what a file keeps under transparent pixels is anything: the nearest opaque colour takes its place
    nearest = ndimage.distance_transform_edt(image[..., 3] < 250, return_distances=False, return_indices=True)
    colours = image[nearest[0], nearest[1], :3]
    frame = np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]])
    findings = ("the image border cuts the object",) if frame.mean() > 0.02 else ()
    return Matte(np.dstack([colours, alpha]), "alpha", 1.0, findings, {})


def _reject_doubtful(
    name: str, scores: MatteScores, found: Segmentation, min_confidence: float, second_object_share: float
) -> None:
    if scores.confidence_of_pieces >= min_confidence:
        _reject_several(name, found.mask, second_object_share)
    if scores.confidence < min_confidence:
        cause = frame_cause(found.background, found.gradient) or scores.worst
        raise Rejected(
            "low_confidence_matte",
            f"{name}: the object cannot be told from the background (confidence {scores.confidence:.2f} <"
            f" {min_confidence:g}): {_CAUSES[cause]}; {_REMEDY}",
            "generate",
        )


def _reject_several(name: str, mask: np.ndarray, second_object_share: float) -> None:
    _, _, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    areas = stats[1:, cv2.CC_STAT_AREA]
    count = int((areas >= second_object_share * areas.max()).sum())
    if count > 1:
        raise Rejected(
            "several_objects", f"{name}: {count} separate objects; crop the photo to one of them", "generate"
        )


def _largest(mask: np.ndarray) -> np.ndarray:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    return labels == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())


def _findings(scores: MatteScores, found: Segmentation) -> list[str]:
    findings = []
    if scores.uncut < 1:
        findings.append("the image border touches the object")
    if scores.whole < 1:
        findings.append("small separate pieces were left out")
    if found.shadow.sum() > 0.02 * found.mask.sum():
        findings.append("a cast shadow was left out")
    return findings
