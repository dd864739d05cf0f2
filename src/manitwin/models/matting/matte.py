"""The matte of a photo: which pixels are the object, how that was found, and how far it can be believed."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Literal

import cv2
import numpy as np
from scipy import ndimage

from manitwin.config import MattingConfig
from manitwin.errors import Rejected
from manitwin.models.matting.belief import WHOLE, features, probability
from manitwin.models.matting.candidates import NETWORKS, Candidate, alike, at_size, candidates, completed
from manitwin.models.matting.causes import CAUSES, REMEDY, cause_of
from manitwin.models.matting.confidence import MatteScores, frame_cause
from manitwin.models.matting.enlarged import enlarged
from manitwin.models.matting.fine_outline import fine_outline
from manitwin.models.matting.learned import Network, learned_alpha
from manitwin.models.matting.object_network import in_two_looks, object_share
from manitwin.models.matting.outline import dilated, without_small_holes
from manitwin.models.matting.segmentation import Segmentation, segment

TRANSPARENT_SHARE = 0.02
PLAIN_NOISE_LAB = 4.0
MIN_CONFIDENCE = MattingConfig().min_confidence
LIKELY = 0.5  # that pieces are things: the photo is rejected in any case, and that is the cause


@dataclass(frozen=True)
class Matte:
    """``rgba (H, W, 4) uint8``, alpha 255 on the object; ``confidence`` in [0, 1]; ``scores`` say where it comes from.

    ``confidence`` is how likely the cut-out is right (``belief``); ``agreement`` is that of each opinion with the matte, in
    [0, 1], by the opinion's name.
    """

    rgba: np.ndarray
    method: Literal["alpha", "flat_border", "grabcut", "network"]
    confidence: float
    findings: tuple[str, ...]
    scores: dict[str, float]
    agreement: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Judged:
    """A candidate with its ``features``."""

    candidate: Candidate
    features: np.ndarray

    @property
    def confidence(self) -> float:
        """How likely the candidate is right."""
        return probability(self.features)

    @property
    def of_pieces(self) -> float:
        """How likely it is that what was found is no background, be it one piece or several."""
        return probability(np.where(WHOLE, 0.0, self.features))


@dataclass(frozen=True)
class Study:
    """What was found in a photo before anything is decided.

    ``found`` is that of the rules, ``judged`` every candidate, the likeliest first, ``alpha (H, W) uint8`` the first at the
    photo's size, empty where there is none, ``shares`` (h, w) what each of the ``NETWORKS`` says, filled within its outline.
    """

    found: Segmentation
    judged: list[Judged]
    alpha: np.ndarray
    shares: list[np.ndarray]

    @property
    def confidence(self) -> float:
        """The confidence in ``alpha``, 0 where nothing was found."""
        return self.judged[0].confidence if self.judged else 0.0

    @property
    def plain(self) -> bool:
        """Whether smooth surfaces explain the border."""
        background = self.found.background
        return background.noise_lab < PLAIN_NOISE_LAB and background.unexplained < 0.05

    @property
    def agreement(self) -> dict[str, float]:
        """The agreement of each opinion with the mask, by the opinion's name."""
        chosen = self.judged[0].candidate.found
        said = {
            "rules": alike(chosen.mask, self.found.mask),
            "colours": chosen.known_to_colours,
        }
        for name, share in zip(NETWORKS, self.shares, strict=False):
            said[name] = alike(chosen.mask, at_size(share, chosen.mask.shape) > 0.5)
        return {name: round(value, 4) for name, value in said.items()}


def study_photo(rgb: np.ndarray, *, working_side_px: int = 512, network: Network | None = None) -> Study:
    """Find the object in ``rgb`` (H, W, 3) uint8 upright sRGB and judge what was found; nothing is rejected here.

    A ``network`` is asked besides the built-in one. Raises Unavailable without the built-in network's weights, BadReply where
    the given one cannot be run.
    """
    found, judged, shares = judged_candidates(rgb, working_side_px=working_side_px, network=network)
    if not judged:
        return Study(found, [], np.zeros(rgb.shape[:2], np.uint8), shares)
    judged = sorted(judged, key=lambda each: -each.confidence)
    return Study(found, judged, drawn(rgb, judged[0].candidate.found.mask, working_side_px), shares)


def judged_candidates(
    rgb: np.ndarray, *, working_side_px: int = 512, network: Network | None = None
) -> tuple[Segmentation, list[Judged], list[np.ndarray]]:
    """Return what the rules found, every candidate with its features, and each network's share of object, as ``study_photo``.

    Of two networks the one counts that speaks better for a candidate. A photo smaller than ``working_side_px`` is ``enlarged``.
    """
    photo_side_px = max(rgb.shape[:2])
    rgb = enlarged(rgb, working_side_px)
    found = segment(_scaled(rgb, working_side_px))
    if _longest_side(found.mask) < 0.5 * max(found.mask.shape) and max(rgb.shape[:2]) > 1.2 * working_side_px:
        found = segment(_scaled(rgb, 2 * working_side_px))  # a small thing is looked at again, closer
    asked = (None,) if network is None else (network, None)
    shares = [completed(network_share(rgb, max(found.mask.shape), each), found) for each in asked]
    made = candidates(found, shares, zoom=photo_side_px / max(found.mask.shape))
    judged = []
    for each in made:
        others = [other for other in made if other is not each and other.independent]
        beside = [Judged(each, features(each, others, share)) for share in shares]
        judged.append(max(beside, key=lambda one: one.confidence))
    return found, judged, shares


def network_share(rgb: np.ndarray, side_px: int, network: Network | None) -> np.ndarray:
    """Return the share of object (h, w) of each pixel of ``rgb``, at most ``side_px`` large, as a network has it."""
    if network is None:
        return object_share(_scaled(rgb, side_px))
    return in_two_looks(_scaled(rgb, max(side_px, *network.side_px)), lambda seen: learned_alpha(network, seen))


def drawn(rgb: np.ndarray, mask: np.ndarray, working_side_px: int = 512) -> np.ndarray:
    """Return the largest piece of a mask (any size) as alpha (H, W) uint8 at the size of ``rgb``, with a soft outline."""
    seen = enlarged(rgb, working_side_px)
    alpha = fine_outline(seen, _largest(mask))
    if max(seen.shape[:2]) <= 2 * working_side_px:  # of larger photos the first look is finer than is needed
        alpha = fine_outline(seen, alpha > 127)
    return alpha if seen is rgb else cv2.resize(alpha, rgb.shape[1::-1], interpolation=cv2.INTER_AREA)


def matte_photo(
    image: np.ndarray,
    name: str,
    *,
    working_side_px: int = 512,
    min_confidence: float = MIN_CONFIDENCE,
    min_area_share: float = 0.002,
    second_object_share: float = 0.12,
    network: Network | None = None,
) -> Matte:
    """Find the object in ``image`` (H, W, 3 or 4) uint8 upright sRGB; ``name`` is used in messages only.

    A real alpha channel (more than 2 % transparent) is believed. Else two ways of looking each propose a mask: rules (smooth
    surfaces grown from the border, flooded up to the photo's edges, and colours) and the built-in network, and a third, where
    it is given, ``network``; the likeliest is taken, by its scores and by how far opinions agree with it: ``flat_border`` is the
    rules' where smooth surfaces explain the border, ``grabcut`` the rules' where they do not, ``network`` a network's.

    Raises Rejected: ``no_object``, ``several_objects``, ``low_confidence_matte``, naming cause and remedy.
    """
    if image.shape[2] == 4 and (image[..., 3] < 250).mean() > TRANSPARENT_SHARE:
        return _given_matte(image, name, min_area_share, second_object_share)
    rgb = np.ascontiguousarray(image[..., :3])
    study = study_photo(rgb, working_side_px=working_side_px, network=network)
    chosen = decided(
        study,
        name,
        min_confidence=min_confidence,
        min_area_share=min_area_share,
        second_object_share=second_object_share,
    )
    return Matte(
        rgba=np.dstack([rgb, study.alpha]),
        method="network" if chosen.candidate.by_network else "flat_border" if study.plain else "grabcut",
        confidence=round(chosen.confidence, 4),
        findings=tuple(_findings(chosen.candidate.scores, chosen.candidate.found)),
        scores={key: round(value, 4) for key, value in asdict(chosen.candidate.scores).items()},
        agreement=study.agreement,
    )


def decided(
    study: Study,
    name: str,
    *,
    min_confidence: float = MIN_CONFIDENCE,
    min_area_share: float = 0.002,
    second_object_share: float = 0.12,
) -> Judged:
    """Return the candidate of a study that is believed; raises Rejected as ``matte_photo`` where none is."""
    if not study.judged or study.judged[0].candidate.found.mask.mean() < min_area_share:
        if not study.plain:
            raise Rejected(
                "low_confidence_matte", f"{name}: {CAUSES['plain']} to tell an object from it; {REMEDY}", "generate"
            )
        raise Rejected(
            "no_object", f"{name}: nothing stands out of the background; photograph the object larger", "generate"
        )
    _reject_doubtful(name, study.judged[0], min_confidence, second_object_share)
    return study.judged[0]


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


def _reject_doubtful(name: str, judged: Judged, min_confidence: float, second_object_share: float) -> None:
    found = judged.candidate.found
    if judged.of_pieces >= min(min_confidence, LIKELY):
        _reject_several(name, found.mask, second_object_share)
    if judged.confidence < min_confidence:
        cause = frame_cause(found.background, found.gradient) or cause_of(judged.features, judged.candidate.scores)
        raise Rejected(
            "low_confidence_matte",
            f"{name}: the object cannot be told from the background (confidence {judged.confidence:.2f} <"
            f" {min_confidence:g}): {CAUSES[cause]}; {REMEDY}",
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
