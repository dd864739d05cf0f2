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
"""Scores below this count as this: their logarithm is taken."""
SCORES = (
    *("on_edges", "crisp", "separable", "complete", "uncut", "stable", "whole", "plain", "outermost"),
    *("sharply_bounded", "unshaded", "solid", "thick"),
)
"""Features that are the logarithms of a mask's scores (``MatteScores``)."""
OPINIONS = ("network_alike", "network_sharp", "network_within", "network_beyond", "colours", "rival")
"""Features that compare the mask with what a network, the colours and the next best mask say."""
BULKY = 18.75
"""Pixels of area for each pixel of outline, in the photo: from here on an outline that is off by a fraction of a pixel costs next
to no intersection over union."""
MOST_SOFT_PX = 8.0
"""Unsure pixels of a network across the outline, in pixels of the photo: wider is no larger doubt."""
MOST_MISJUDGED = 0.05
"""Of a mask's area: a cut-out that may be wrong of so much of the thing is not believed, whatever else speaks for it."""
LEAST_DIFFERENCE = 0.005
"""A share of the mask's area: opinions that differ by less count as alike; beyond, each doubling adds as much doubt."""
FEATURES = (*SCORES, *OPINIONS, "kept", "bulk", "made_by_rules")
BEST = np.zeros(len(FEATURES))
"""The best value of each feature; that of ``made_by_rules`` is never a doubt."""
WHOLE = np.array([name == "whole" for name in FEATURES])
"""Selects the feature that doubts a mask beside which other pieces lie."""


def features(candidate: Candidate, others: list[Candidate], share: np.ndarray) -> np.ndarray:
    """Return the features (F,) of a candidate beside the ``others``, given a network's ``share`` of object (any size).

    Of the others only the one that is most like the candidate counts.
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
    """Return the doubt that a difference is, which is a share of the mask's area: 0 for none, growing with its logarithm."""
    return float(np.log1p(min(share, 1.0) / LEAST_DIFFERENCE))


def probability(values: np.ndarray) -> float:
    """Return how likely a mask with these ``features`` is right, in [0, 1].

    The fitted doubts count, and those of ``unfitted``.
    """
    bias, weights = _weights()
    return float(unfitted(values) / (1 + np.exp(-np.clip(bias + weights @ values, -30, 30))))


def unfitted(values: np.ndarray) -> float:
    """Return the factor in [0, 1] by which two further doubts lower the probability.

    Composites show them too seldom for a fit: a part in focus that may be lost or a hole that may be filled (``kept``), and
    ground that may be seen through the mask (``solid``).
    """
    return float((1 + values[FEATURES.index("kept")]) * np.exp(values[FEATURES.index("solid")]))


def doubts_of(values: np.ndarray) -> dict[str, float]:
    """Return what each of the ``features`` but ``made_by_rules`` costs a mask, in log-odds, against its best value."""
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
