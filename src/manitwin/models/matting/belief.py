"""How likely a mask is right: a logistic function of its scores and of how far the opinions agree, fitted on composites.

Every feature is such that more is better, and no weight is negative, so that no doubt can make a mask more likely.
``benchmarks/matting_belief.py`` fits the weights on composites whose masks are known (their calibration part); a mask is right
where one whole thing is in the picture and the intersection over union with its truth is above 0.95.
"""

from __future__ import annotations

from dataclasses import asdict
from functools import cache
from importlib.resources import files

import numpy as np

from manitwin.errors import ConfigError
from manitwin.formats.json_file import parse_json_object
from manitwin.models.matting.candidates import Candidate, alike, at_size, doubts, misjudged
from manitwin.models.matting.confidence import MOST_ZOOM
from manitwin.models.matting.outline import eroded

WEIGHTS_FILE = "belief.json"
LEAST = 0.02
"""A score below that is as bad as none."""
SCORES = (
    *("on_edges", "crisp", "separable", "complete", "uncut", "stable", "whole", "plain", "outermost"),
    *("sharply_bounded", "unshaded", "solid", "thick"),
)
OPINIONS = ("network_alike", "network_sharp", "network_within", "network_beyond", "colours", "rival")
BULKY = 18.75
"""Pixels of the photo, of area for each of the outline: a fraction of a pixel off costs a bulkier thing next to nothing."""
MOST_SOFT_PX = 8.0
MOST_MISJUDGED = 0.05
"""Of a mask's area: a cut-out that may be wrong of so much of the thing is not believed, whatever else speaks for it."""
LEAST_DIFFERENCE = 0.005
"""Of a mask's area: opinions that differ by less are alike. Beyond, each doubling of the difference is as much of a doubt."""
FEATURES = (*SCORES, *OPINIONS, "kept", "bulk", "made_by_rules")
BEST = np.zeros(len(FEATURES))
"""What nothing can be better than, by feature; who made the mask is no doubt of it."""
WHOLE = np.array([name == "whole" for name in FEATURES])


def features(candidate: Candidate, others: list[Candidate], share: np.ndarray) -> np.ndarray:
    """Return the features (F,) of a candidate beside the ``others``, given a network's ``share`` of object (any size).

    Of several others the one that is most like it counts.
    """
    mask = candidate.found.mask
    share = at_size(share, mask.shape)
    unsure, within, beyond = doubts(share, mask)
    bulk_px = float(mask.sum() / max(int((mask & ~eroded(mask, 1)).sum()), 1)) * min(candidate.zoom, MOST_ZOOM)
    scores = asdict(candidate.scores)
    rivals = [alike(mask, other.found.mask) for other in others]
    opinions = {
        "network_alike": -_difference(1 - alike(mask, share > 0.5)),
        "network_sharp": -min(unsure * bulk_px, MOST_SOFT_PX),
        "network_within": -_difference(within),
        "network_beyond": -_difference(beyond),
        "colours": -_difference(1 - candidate.found.known_to_colours),
        "rival": -_difference(1 - max(rivals, default=0.0)),
    }
    return np.array(
        [
            *(np.log(max(scores[name], LEAST)) for name in SCORES),
            *(opinions[name] for name in OPINIONS),
            -min(misjudged(candidate, others, share) / MOST_MISJUDGED, 1.0),
            min(0.0, float(np.log(bulk_px / BULKY))),
            float(not candidate.by_network),
        ]
    )


def _difference(share: float) -> float:
    """Return how much of a doubt a difference is, given as a share of a mask's area: 0 of none, by its logarithm."""
    return float(np.log1p(min(share, 1.0) / LEAST_DIFFERENCE))


def probability(values: np.ndarray) -> float:
    """Return how likely a mask with these ``features`` is right, in [0, 1].

    The fitted doubts count, and those of ``unfitted``.
    """
    bias, weights = _weights()
    return float(unfitted(values) / (1 + np.exp(-np.clip(bias + weights @ values, -30, 30))))


def unfitted(values: np.ndarray) -> float:
    """Return by what factor in [0, 1] two doubts lower the probability that composites hardly show.

    A part in focus that may be lost, or a hole that may be filled (``kept``), and ground that may be seen through the mask
    (``solid``).
    """
    return float((1 + values[FEATURES.index("kept")]) * np.exp(values[FEATURES.index("solid")]))


def doubts_of(values: np.ndarray) -> dict[str, float]:
    """Return what each of the ``features`` but the maker costs a mask, in log-odds against the best that there is."""
    _, weights = _weights()
    doubts = dict(zip(FEATURES[:-1], (weights * (BEST - values))[:-1].tolist(), strict=True))
    doubts["kept"] -= float(np.log(max(1 + values[FEATURES.index("kept")], LEAST)))
    doubts["solid"] -= float(values[FEATURES.index("solid")])
    return doubts


@cache
def _weights() -> tuple[float, np.ndarray]:
    content = (files("manitwin.models.matting") / WEIGHTS_FILE).read_bytes()
    fitted = parse_json_object(content, WEIGHTS_FILE, ConfigError, remedy="install the package again")
    return float(fitted["bias"]), np.array([fitted["weights"][name] for name in FEATURES])
