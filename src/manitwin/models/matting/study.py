"""What is found in a photo and how likely each mask is right, before anything is decided."""

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
    at_size,
    candidates,
    completed,
    network_makers,
    network_mask,
)
from manitwin.models.matting.digital_ground import without_haze
from manitwin.models.matting.enlarged import enlarged
from manitwin.models.matting.fine_outline import fine_outline
from manitwin.models.matting.learned import Network, learned_alpha
from manitwin.models.matting.object_network import in_two_looks, object_share
from manitwin.models.matting.segmentation import Segmentation, segment
from manitwin.models.matting.trimmed import exact_ground, with_margin

PLAIN_NOISE_LAB = 4.0
EXPLAINED_ODDS = 12.0
"""How many times likelier a doubtful mask that is right has the outline of its template than one that is wrong: of such masks of
composites and made photos 17 of 29 that are right have it, and 2 of 43 that are not."""
AGREED_ODDS = 3.0
"""How many times likelier a doubtful mask of one whole thing that is right is seen by both of two named networks."""


@dataclass(frozen=True)
class Judged:
    """A candidate with its ``features``.

    ``is_explained``: its outline is that of the thing that it is said to be; ``is_agreed``: two networks that a person named
    both see it, and nothing speaks against one whole thing, which they do not tell.
    """

    candidate: Candidate
    features: np.ndarray
    is_explained: bool = False
    is_agreed: bool = False

    @property
    def by_itself(self) -> float:
        """How likely the candidate is right by what the photo shows."""
        return probability(self.features)

    @property
    def confidence(self) -> float:
        """How likely the candidate is right."""
        odds = (EXPLAINED_ODDS if self.is_explained else 1.0) * (AGREED_ODDS if self.is_agreed else 1.0)
        return odds * self.by_itself / (odds * self.by_itself + 1 - self.by_itself)

    @property
    def of_pieces(self) -> float:
        """How likely it is that what was found is no background, be it one piece or several."""
        return probability(np.where(WHOLE, 0.0, self.features))


@dataclass(frozen=True)
class Study:
    """What was found in a photo before anything is decided.

    ``found`` is that of the rules, ``judged`` every candidate, the likeliest first, ``alpha (H, W) uint8`` the first at the
    photo's size, empty where there is none, ``shares`` (h, w) what each of the ``network_makers`` says, filled within its
    outline. Masks and shares of a photo that was trimmed to the thing are those of the photo ``with_margin``.
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
        for name, share in zip(network_makers(len(self.shares)), self.shares, strict=True):
            said[name] = alike(chosen.mask, at_size(share, chosen.mask.shape) > 0.5)
        return {name: round(value, 4) for name, value in said.items()}


def study_photo(rgb: np.ndarray, *, working_side_px: int = 512, networks: Sequence[Network] = ()) -> Study:
    """Find the object in ``rgb`` (H, W, 3) uint8 upright sRGB and judge what was found; nothing is rejected here.

    ``networks``, two at most, are asked besides the built-in one. Raises Unavailable without the built-in network's weights,
    BadReply where a given one cannot be run.
    """
    found, judged, shares = judged_candidates(rgb, working_side_px=working_side_px, networks=networks)
    if not judged:
        return Study(found, [], np.zeros(rgb.shape[:2], np.uint8), shares)
    judged = sorted(judged, key=lambda each: -each.confidence)
    return Study(found, judged, drawn(rgb, judged[0].candidate.found.mask, working_side_px), shares)


def study_in_turn(
    rgb: np.ndarray, networks: Sequence[Network], *, min_confidence: float, working_side_px: int = 512
) -> Study:
    """Study a photo as ``study_photo``: one of the ``networks`` is asked at once, two only where nothing is believed without.

    Thin tools that are believed without them two networks often see differently, and would doubt.
    """
    if len(networks) < 2:
        return study_photo(rgb, working_side_px=working_side_px, networks=networks)
    study = study_photo(rgb, working_side_px=working_side_px)
    if study.confidence >= min_confidence:
        return study
    return study_photo(rgb, working_side_px=working_side_px, networks=networks)


def judged_candidates(
    rgb: np.ndarray, *, working_side_px: int = 512, networks: Sequence[Network] = ()
) -> tuple[Segmentation, list[Judged], list[np.ndarray]]:
    """Return what the rules found, every candidate with its features, and each network's share of object, as ``study_photo``.

    Of two networks the one counts that speaks better for a candidate, of three the second best: two must speak for it. A photo
    smaller than ``working_side_px`` is ``enlarged``, one that was trimmed to the thing is seen ``with_margin``.
    """
    exact = exact_ground(rgb)
    rgb, _ = with_margin(rgb)
    photo_side_px = max(rgb.shape[:2])
    rgb = enlarged(rgb, working_side_px)
    found = segment(_scaled(rgb, working_side_px))
    if _longest_side(found.mask) < 0.5 * max(found.mask.shape) and max(rgb.shape[:2]) > 1.2 * working_side_px:
        found = segment(_scaled(rgb, 2 * working_side_px))  # a small thing is looked at again, closer
    asked = (*networks, None)
    shares = [network_share(rgb, max(found.mask.shape), each) for each in asked]
    if exact is not None:
        shares = [without_haze(share, rgb, exact) for share in shares]
    shares = [completed(share, found, exact=exact is not None) for share in shares]
    agreed = _seen_alike(shares[:-1], found.mask.shape)
    made = candidates(found, shares, zoom=photo_side_px / max(found.mask.shape))
    judged = []
    for each in made:
        others = [other for other in made if other is not each and other.independent]
        is_agreed = agreed is not None and each.scores.of_one_whole and alike(each.found.mask, agreed) > AGREEING
        beside = sorted(
            (Judged(each, features(each, others, share), is_agreed=is_agreed) for share in shares),
            key=lambda one: -one.confidence,
        )
        judged.append(beside[1 if len(beside) > 2 else 0])
    return found, judged, shares


def _seen_alike(shares: Sequence[np.ndarray], shape: tuple[int, ...]) -> np.ndarray | None:
    """Return the mask (H, W) that two networks see alike, given their shares of object; None where they differ or are not two."""
    masks = [network_mask(share, shape) for share in shares]
    return masks[0] if len(masks) == 2 and alike(*masks) > AGREEING else None


def network_share(rgb: np.ndarray, side_px: int, network: Network | None) -> np.ndarray:
    """Return the share of object (h, w) of each pixel of ``rgb``, at most ``side_px`` large, as a network has it."""
    if network is None:
        return object_share(_scaled(rgb, side_px))
    return in_two_looks(_scaled(rgb, max(side_px, *network.side_px)), lambda seen: learned_alpha(network, seen))


def drawn(rgb: np.ndarray, mask: np.ndarray, working_side_px: int = 512) -> np.ndarray:
    """Return the largest piece of a mask (any size) as alpha (H, W) uint8 at the size of ``rgb``, with a soft outline.

    The mask is that of the photo ``with_margin``.
    """
    wider, margin_px = with_margin(rgb)
    seen = enlarged(wider, working_side_px)
    alpha = fine_outline(seen, largest_piece(mask))
    if max(seen.shape[:2]) <= 2 * working_side_px:  # of larger photos the first look is finer than is needed
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
    """Return the largest connected piece of a mask that is not empty."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    return labels == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
