"""Candidate masks of a photo, each with its probability of being right, before one is accepted or rejected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from manitwin.models.matting.belief import WHOLE, features, probability
from manitwin.models.matting.candidates import (
    AGREEING,
    Candidate,
    alike,
    candidates,
    completed,
    network_makers,
    network_mask,
    resize_share,
)
from manitwin.models.matting.fine_outline import fine_outline
from manitwin.models.matting.learned import Network, learned_alpha
from manitwin.models.matting.object_network import evaluate_coarse_to_fine, object_share
from manitwin.models.matting.segmentation import Segmentation, segment
from manitwin.models.matting.trimmed import restore_margin, uniform_background_colour
from manitwin.models.matting.uniform_background import subtract_haze
from manitwin.models.matting.upsampling import enlarge_photo

PLAIN_NOISE_LAB = 4.0
EXPLAINED_ODDS = 12.0
"""Odds ratio for a doubtful mask whose outline matches its template: right masks against wrong ones.

Among doubtful masks of composites and synthetic photos, 17 of 29 right ones match their template and 2 of 43 wrong ones do.
"""
AGREED_ODDS = 3.0
"""Odds ratio for a doubtful mask of one whole object that both of two user-named networks find."""


@dataclass(frozen=True)
class ScoredCandidate:
    """A candidate mask with its ``features``.

    ``is_explained``: its outline matches the template of the object that the photo is said to show. ``is_agreed``: two
    user-named networks both find it, and its scores indicate one whole object, which the networks cannot tell.
    """

    candidate: Candidate
    features: np.ndarray
    is_explained: bool = False
    is_agreed: bool = False

    @property
    def photo_confidence(self) -> float:
        """Probability that the candidate is right, from the photo alone."""
        return probability(self.features)

    @property
    def confidence(self) -> float:
        """Probability that the candidate is right, with the odds of explanation and agreement."""
        odds = (EXPLAINED_ODDS if self.is_explained else 1.0) * (AGREED_ODDS if self.is_agreed else 1.0)
        return odds * self.photo_confidence / (odds * self.photo_confidence + 1 - self.photo_confidence)

    @property
    def pieces_confidence(self) -> float:
        """Probability that the mask contains no background, whether it has one piece or several."""
        return probability(np.where(WHOLE, 0.0, self.features))


@dataclass(frozen=True)
class Study:
    """Analysis of a photo before a mask is accepted.

    ``found`` is the segmentation by the rules. ``judged`` has all candidates, the most probable first. ``alpha (H, W) uint8``
    is the first candidate at the size of the photo, empty if there is no candidate. ``shares`` (h, w) are the foreground
    probabilities of the ``network_makers``, completed inside their outlines. For a photo that was trimmed to the object,
    masks and shares refer to the photo ``restore_margin``.
    """

    found: Segmentation
    judged: list[ScoredCandidate]
    alpha: np.ndarray
    shares: list[np.ndarray]

    @property
    def confidence(self) -> float:
        """Confidence in ``alpha``, 0 if there is no candidate."""
        return self.judged[0].confidence if self.judged else 0.0

    @property
    def plain(self) -> bool:
        """Whether smooth surfaces explain the border of the photo."""
        background = self.found.background
        return background.noise_lab < PLAIN_NOISE_LAB and background.unexplained < 0.05

    @property
    def agreement(self) -> dict[str, float]:
        """Agreement of each opinion with the best mask, by the opinion's name."""
        chosen = self.judged[0].candidate.found
        said = {
            "rules": alike(chosen.mask, self.found.mask),
            "colours": chosen.known_to_colours,
        }
        for name, share in zip(network_makers(len(self.shares)), self.shares, strict=True):
            said[name] = alike(chosen.mask, resize_share(share, chosen.mask.shape) > 0.5)
        return {name: round(value, 4) for name, value in said.items()}


def study_photo(rgb: np.ndarray, *, working_side_px: int = 512, networks: Sequence[Network] = ()) -> Study:
    """Find and score candidate masks in ``rgb`` (H, W, 3) uint8, upright sRGB; nothing is rejected here.

    ``networks``, at most two, are evaluated in addition to the built-in one. Raises Unavailable without the built-in
    network's weights, BadReply if a given network cannot be run.
    """
    found, judged, shares = judged_candidates(rgb, working_side_px=working_side_px, networks=networks)
    if not judged:
        return Study(found, [], np.zeros(rgb.shape[:2], np.uint8), shares)
    judged = sorted(judged, key=lambda each: -each.confidence)
    return Study(found, judged, drawn(rgb, judged[0].candidate.found.mask, working_side_px), shares)


def study_in_turn(
    rgb: np.ndarray, networks: Sequence[Network], *, min_confidence: float, working_side_px: int = 512
) -> Study:
    """Study a photo as ``study_photo``, but evaluate two additional ``networks`` only if no mask is accepted without them.

    A single additional network is always evaluated. Two networks often disagree about thin tools that are accepted without
    them, and would lower their confidence.
    """
    if len(networks) < 2:
        return study_photo(rgb, working_side_px=working_side_px, networks=networks)
    study = study_photo(rgb, working_side_px=working_side_px)
    if study.confidence >= min_confidence:
        return study
    return study_photo(rgb, working_side_px=working_side_px, networks=networks)


def judged_candidates(
    rgb: np.ndarray, *, working_side_px: int = 512, networks: Sequence[Network] = ()
) -> tuple[Segmentation, list[ScoredCandidate], list[np.ndarray]]:
    """Return the rules' segmentation, all candidates with their features, and each network's foreground probability.

    Arguments and errors are those of ``study_photo``. Each candidate is compared with every network; the best comparison
    counts for one or two networks and the second best for three, so that two of three must support it. A photo smaller than
    ``working_side_px`` is ``enlarged``, a photo that was trimmed to the object is extended (``restore_margin``).
    """
    exact = uniform_background_colour(rgb)
    rgb, _ = restore_margin(rgb)
    photo_side_px = max(rgb.shape[:2])
    rgb = enlarge_photo(rgb, working_side_px)
    found = segment(_scaled(rgb, working_side_px))
    if _longest_side(found.mask) < 0.5 * max(found.mask.shape) and max(rgb.shape[:2]) > 1.2 * working_side_px:
        found = segment(_scaled(rgb, 2 * working_side_px))  # segment a small object again at twice the resolution
    asked = (*networks, None)
    shares = [network_share(rgb, max(found.mask.shape), each) for each in asked]
    if exact is not None:
        shares = [subtract_haze(share, rgb, exact) for share in shares]
    shares = [completed(share, found, exact=exact is not None) for share in shares]
    agreed = _agreed_mask(shares[:-1], found.mask.shape)
    made = candidates(found, shares, zoom=photo_side_px / max(found.mask.shape))
    judged = []
    for each in made:
        others = [other for other in made if other is not each and other.independent]
        is_agreed = agreed is not None and each.scores.is_whole_object and alike(each.found.mask, agreed) > AGREEING
        beside = sorted(
            (ScoredCandidate(each, features(each, others, share), is_agreed=is_agreed) for share in shares),
            key=lambda one: -one.confidence,
        )
        judged.append(beside[1 if len(beside) > 2 else 0])
    return found, judged, shares


def _agreed_mask(shares: Sequence[np.ndarray], shape: tuple[int, ...]) -> np.ndarray | None:
    """Return the mask (H, W) on which exactly two networks agree, given their foreground probabilities; otherwise None."""
    masks = [network_mask(share, shape) for share in shares]
    return masks[0] if len(masks) == 2 and alike(*masks) > AGREEING else None


def network_share(rgb: np.ndarray, side_px: int, network: Network | None) -> np.ndarray:
    """Return a network's foreground probability (h, w) for ``rgb``, scaled down to at most ``side_px``.

    None stands for the built-in network. A user-named network sees the picture at its own input size if that is larger.
    """
    if network is None:
        return object_share(_scaled(rgb, side_px))
    return evaluate_coarse_to_fine(
        _scaled(rgb, max(side_px, *network.side_px)), lambda seen: learned_alpha(network, seen)
    )


def drawn(rgb: np.ndarray, mask: np.ndarray, working_side_px: int = 512) -> np.ndarray:
    """Return the largest piece of a mask (any size) as alpha (H, W) uint8 at the size of ``rgb``, with a soft outline.

    The mask refers to the photo ``restore_margin``; the margin is cut off again.
    """
    wider, margin_px = restore_margin(rgb)
    seen = enlarge_photo(wider, working_side_px)
    alpha = fine_outline(seen, largest_piece(mask))
    if max(seen.shape[:2]) <= 2 * working_side_px:  # the first pass is fine enough for larger photos
        alpha = fine_outline(seen, alpha > 127)
    alpha = alpha if seen is wider else cv2.resize(alpha, wider.shape[1::-1], interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(alpha[margin_px : margin_px + rgb.shape[0], margin_px : margin_px + rgb.shape[1]])


def _scaled(rgb: np.ndarray, side_px: int) -> np.ndarray:
    scale = side_px / max(rgb.shape[:2])
    return cv2.resize(rgb, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1 else rgb


def _longest_side(mask: np.ndarray) -> int:
    rows, columns = np.nonzero(mask)
    return int(max(np.ptp(rows), np.ptp(columns))) + 1 if len(rows) else 0


def largest_piece(mask: np.ndarray) -> np.ndarray:
    """Return the largest connected piece of a non-empty mask."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    return labels == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
