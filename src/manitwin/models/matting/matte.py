"""Matting of a photo: the object's alpha mask, the method that produced it, and its confidence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Literal

import cv2
import numpy as np
from scipy import ndimage

from manitwin.config import MattingConfig
from manitwin.errors import Rejected
from manitwin.geometry.pixel_boxes import PixelBox, crop_to_image_box
from manitwin.models.matting.confidence import border_of
from manitwin.models.matting.learned import Network
from manitwin.models.matting.outline import dilated, fill_small_holes
from manitwin.models.matting.rejection_causes import CAUSES, REMEDY, told
from manitwin.models.matting.study import ScoredCandidate, Study, largest_piece, study_in_turn
from manitwin.models.matting.template_confirmation import Explains, prefer_explained
from manitwin.models.matting.trimmed import trimmed_margin

TRANSPARENT_SHARE = 0.02
MIXED_PX = 4
"""Distance in pixels from opaque pixels within which colours may be mixed with the former background."""
SHADOW_AWAY, SHADOW_SHARE = 0.01, 0.005
"""Limits for a reported cast shadow: distance from the object as a share of the longer side, and area as a share of the object's.

In 25 rendered objects without a shadow, at most 0.0036 of the object's area was classified as shadow at that distance.
"""
LEFT_OUT_SHARE = 0.002
"""Share of the visible alpha mask; smaller discarded pieces are dust and are not reported."""
TRIMMED = "the image border touches the object, which is taken to end there: the photo was trimmed to it"
MIN_CONFIDENCE = MattingConfig().min_confidence
MOST_BOXES = 6
"""Maximum number of object boxes that the rejection message lists."""
LIKELY = (
    0.5  # minimum probability that separate pieces are objects; the photo is rejected anyway, this selects the reason
)


@dataclass(frozen=True)
class Matte:
    """Alpha matte of a photo.

    ``rgba (H, W, 4) uint8`` has alpha 255 on the object. ``confidence`` in [0, 1] is the estimated probability that the mask
    is right (see ``belief``), ``scores`` are the measurements behind it, and ``agreement`` is the agreement in [0, 1] of each
    opinion with the mask, by the opinion's name.
    """

    rgba: np.ndarray
    method: Literal["alpha", "flat_border", "grabcut", "network"]
    confidence: float
    findings: tuple[str, ...]
    scores: dict[str, float]
    agreement: dict[str, float] = field(default_factory=dict)


class DoubtfulMatte(Rejected):
    """Rejection of a mask whose confidence is too low; ``matte`` is the rejected matte."""

    def __init__(self, reason: str, detail: str, matte: Matte):
        super().__init__(reason, detail, "generate")
        self.matte = matte

    def __reduce__(self) -> tuple[type, tuple[str, str, Matte]]:
        return type(self), (self.reason, self.detail, self.matte)


def matte_photo(
    image: np.ndarray,
    name: str,
    *,
    working_side_px: int = 512,
    min_confidence: float = MIN_CONFIDENCE,
    min_area_share: float = 0.002,
    second_object_share: float = 0.12,
    networks: Sequence[Network] = (),
    explains: Explains | None = None,
    window_px: PixelBox | None = None,
) -> Matte:
    """Segment the object in ``image`` (H, W, 3 or 4) uint8, upright sRGB; ``name`` is used in messages only.

    An alpha channel with more than 2 % transparent pixels is used as given. Otherwise candidate masks come from two sources.
    The rules model the background as smooth surfaces grown from the border, flood it up to the edges of the photo, and
    compare colours. The networks are the built-in one and those in ``networks``; two additional networks are evaluated only
    if no candidate is accepted without them. The candidate with the highest confidence is chosen, by its scores and its
    agreement with the other opinions. ``method`` is ``network`` for a mask that a network produced. For a mask of the rules
    it is ``flat_border`` where smooth surfaces explain the border, else ``grabcut``. If no candidate reaches
    ``min_confidence`` and ``explains`` is given, a candidate whose outline it confirms may be accepted (``prefer_explained``).
    ``window_px`` is the box of the whole photo that ``image`` shows, in pixels of the photo; if given, the message about
    separate objects lists their boxes in the photo.

    Raises Rejected with reason ``no_object``, ``several_objects`` or ``low_confidence_matte``, naming cause and remedy; the
    subclass DoubtedCutOut if a mask was found.
    """
    if image.shape[2] == 4 and (image[..., 3] < 250).mean() > TRANSPARENT_SHARE:
        return _given_matte(image, name, min_area_share, second_object_share, window_px)
    rgb = np.ascontiguousarray(image[..., :3])
    study = study_in_turn(rgb, networks, min_confidence=min_confidence, working_side_px=working_side_px)
    if explains is not None and study.confidence < min_confidence:
        study = prefer_explained(rgb, study, explains, min_confidence=min_confidence, working_side_px=working_side_px)
    try:
        accept_candidate(
            study,
            name,
            min_confidence=min_confidence,
            min_area_share=min_area_share,
            second_object_share=second_object_share,
            window_px=None if trimmed_margin(rgb) is not None else window_px,
        )
    except Rejected as answer:
        if answer.reason == "no_object" or not study.judged:
            raise
        raise DoubtfulMatte(answer.reason, answer.detail, _matte_of(rgb, study)) from None
    return _matte_of(rgb, study)


def _matte_of(rgb: np.ndarray, study: Study) -> Matte:
    """Return the matte of the best candidate of a study that has at least one."""
    chosen = study.judged[0]
    return Matte(
        rgba=np.dstack([rgb, study.alpha]),
        method="network" if chosen.candidate.by_network else "flat_border" if study.plain else "grabcut",
        confidence=round(chosen.confidence, 4),
        findings=(*_findings(chosen), *_trimmed(rgb, study.alpha)),
        scores={key: round(value, 4) for key, value in asdict(chosen.candidate.scores).items()},
        agreement=study.agreement,
    )


def accept_candidate(
    study: Study,
    name: str,
    *,
    min_confidence: float = MIN_CONFIDENCE,
    min_area_share: float = 0.002,
    second_object_share: float = 0.12,
    window_px: PixelBox | None = None,
) -> ScoredCandidate:
    """Return the accepted candidate of a study; raises Rejected as ``matte_photo`` if none is accepted."""
    if not study.judged or study.judged[0].candidate.found.mask.mean() < min_area_share:
        if not study.plain:
            raise Rejected(
                "low_confidence_matte", f"{name}: {CAUSES['plain']} to tell an object from it; {REMEDY}", "generate"
            )
        raise Rejected(
            "no_object", f"{name}: nothing stands out of the background; photograph the object larger", "generate"
        )
    _reject_doubtful(name, study.judged[0], min_confidence, second_object_share, window_px)
    return study.judged[0]


def _given_matte(
    image: np.ndarray, name: str, min_area_share: float, second_object_share: float, window_px: PixelBox | None
) -> Matte:
    """Return the matte of an image with an alpha channel, with small holes closed and border colours replaced."""
    mask = image[..., 3] > 127
    if mask.mean() < min_area_share:
        raise Rejected("no_object", f"{name}: its alpha channel is empty; export it with the object opaque", "generate")
    _reject_several(name, mask, second_object_share, window_px)
    # a cut-out tool may remove specular highlights, which leaves small holes in the mask
    closed = largest_piece(fill_small_holes(mask))
    alpha = np.where(closed & ~mask, 255, np.where(dilated(closed, 2), image[..., 3], 0)).astype(np.uint8)
    # Colours under transparent pixels are arbitrary, and those along the outline are mixed with the former background: both are
    # replaced by the nearest opaque colour. Half-transparent areas farther inside, such as glass, keep their colours.
    opaque = image[..., 3] >= 250
    away_px, nearest = ndimage.distance_transform_edt(~opaque if opaque.any() else ~mask, return_indices=True)
    replaced = (away_px <= MIXED_PX) | ~mask
    colours = np.where(replaced[..., None], image[nearest[0], nearest[1], :3], image[..., :3])
    findings = []
    sides = [mask[0], mask[-1], mask[:, 0], mask[:, -1]]
    # an image trimmed to the object touches all sides
    if np.concatenate(sides).mean() > 0.02 and not all(side.any() for side in sides):
        findings.append("the image border cuts the object")
    if (mask & ~closed).sum() > LEFT_OUT_SHARE * mask.sum():
        findings.append("small separate pieces were left out")
    return Matte(np.dstack([colours, alpha]), "alpha", 1.0, tuple(findings), {})


def _rounded_down(confidence: float) -> float:
    """Round a confidence down to hundredths, so that it is not displayed as equal to a limit that it misses."""
    return math.floor(100 * confidence) / 100


def _reject_doubtful(
    name: str, judged: ScoredCandidate, min_confidence: float, second_object_share: float, window_px: PixelBox | None
) -> None:
    """Raise Rejected for separate objects or a confidence below ``min_confidence``."""
    found = judged.candidate.found
    if judged.pieces_confidence >= min(min_confidence, LIKELY):
        _reject_several(name, found.mask, second_object_share, window_px)
    if judged.confidence < min_confidence:
        raise Rejected(
            "low_confidence_matte",
            f"{name}: the object cannot be told from the background (confidence {_rounded_down(judged.confidence):.2f} <"
            f" {min_confidence:g}): {told(judged.candidate, judged.features)}",
            "generate",
        )


def _reject_several(name: str, mask: np.ndarray, second_object_share: float, window_px: PixelBox | None) -> None:
    """Raise Rejected if the mask has several pieces of at least ``second_object_share`` of the largest one's area."""
    _, _, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    areas = stats[1:, cv2.CC_STAT_AREA]
    large = stats[1:][areas >= second_object_share * areas.max()]
    large = large[np.argsort(large[:, cv2.CC_STAT_LEFT], kind="stable")]
    if len(large) > 1:
        boxes = [] if window_px is None else [_photo_box_text(piece, mask.shape, window_px) for piece in large]
        shown = " or ".join(f"--box {box}" for box in boxes[:MOST_BOXES]) + (
            " or ..." if len(boxes) > MOST_BOXES else ""
        )
        raise Rejected(
            "several_objects",
            f"{name}: {len(large)} separate objects; say where one is ({shown or '--box'}), or crop the photo to one of them",
            "generate",
        )


def _photo_box_text(piece: np.ndarray, shape: tuple[int, ...], window_px: PixelBox) -> str:
    """Return the box of a piece in pixels of the photo, as text.

    ``piece`` is x, y, width and height in a mask of this ``shape``.
    """
    left, top, right, bottom = window_px
    x, y, width, height = (float(piece[i]) for i in range(4))
    scale = shape[1] / (right - left), shape[0] / (bottom - top)
    return ",".join(f"{edge:.0f}" for edge in crop_to_image_box((x, y, x + width, y + height), window_px, scale))


def _findings(chosen: ScoredCandidate) -> list[str]:
    """Return the findings about an accepted mask."""
    scores, found, findings = chosen.candidate.scores, chosen.candidate.found, []
    if chosen.is_explained:
        findings.append(
            f"doubtful by itself ({chosen.photo_confidence:.2f}), but its outline is that of the thing it is said to be"
        )
    if scores.uncut < 1:
        findings.append("the image border touches the object")
    if scores.whole < 1:
        findings.append("small separate pieces were left out")
    if _has_cast_shadow(found.shadow, found.mask):
        findings.append("a cast shadow was left out")
    return findings


def _trimmed(rgb: np.ndarray, alpha: np.ndarray) -> list[str]:
    """Return the finding that the photo was trimmed to the object, if it was."""
    touches = bool((alpha > 127)[border_of(alpha.shape)].any())
    return [TRIMMED] if touches and trimmed_margin(rgb) is not None else []


def _has_cast_shadow(shadow: np.ndarray, mask: np.ndarray) -> bool:
    """Tell whether ``shadow`` extends away from the object ``mask``, both ``(H, W) bool``.

    Pixels close to the outline do not count, since a blurred edge is as dark as a shadow.
    """
    away_px = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    reaching = shadow & (away_px > SHADOW_AWAY * max(mask.shape))
    return bool(reaching.sum() > SHADOW_SHARE * mask.sum())
