"""Probability that a mask is right: logistic regression on its scores and on the agreement of the opinions.

For every feature a larger value is better and no weight is negative, so a doubt never raises the probability.
``benchmarks/matting_belief.py`` fits the weights on the calibration part of a set of composites with known masks. A mask
counts as right if the picture shows one whole object and the intersection over union with the true mask exceeds 0.95.
"""

from __future__ import annotations

from dataclasses import asdict
from functools import cache
from importlib.resources import files

import numpy as np

from manitwin.errors import ConfigError
from manitwin.formats.json_file import parse_json_object
from manitwin.models.matting.candidates import Candidate, alike, disputed_share, network_doubts, resize_share
from manitwin.models.matting.confidence import MOST_ZOOM
from manitwin.models.matting.outline import eroded

WEIGHTS_FILE = "belief.json"
LEAST = 0.02
"""Lower bound of a score before its logarithm is taken."""
SCORES = (
    *("on_edges", "crisp", "separable", "complete", "uncut", "stable", "whole", "plain", "outermost"),
    *("sharply_bounded", "unshaded", "solid", "thick"),
)
"""Features that are logarithms of a mask's scores (``MatteScores``)."""
OPINIONS = ("network_alike", "network_sharp", "network_within", "network_beyond", "colours", "rival")
"""Features that compare the mask with the network, the colour model and the next best mask."""
BULKY = 18.75
"""Pixels of area per pixel of outline, in the photo.

Above this, an outline error of a fraction of a pixel hardly lowers the intersection over union.
"""
MOST_SOFT_PX = 8.0
"""Upper bound of the width, in pixels of the photo, of the band along the outline in which the network is uncertain."""
MOST_MISJUDGED = 0.05
"""Share of a mask's area; a mask that may be wrong about that much of the object is rejected whatever its other features are."""
LEAST_DIFFERENCE = 0.005
"""Share of the mask's area; smaller differences count as agreement. Beyond it each doubling adds the same amount of doubt."""
FEATURES = (*SCORES, *OPINIONS, "kept", "bulk", "made_by_rules")
BEST = np.zeros(len(FEATURES))
"""Best value of each feature; that of ``made_by_rules`` never counts as a doubt."""
WHOLE = np.array([name == "whole" for name in FEATURES])
"""Index mask of the feature ``whole``, which is low if the mask has other pieces."""


def features(candidate: Candidate, others: list[Candidate], share: np.ndarray) -> np.ndarray:
    """Return the features (F,) of a candidate, compared with the ``others`` and a network's foreground probability ``share``.

    ``share`` may have any size. Of the other candidates only the one most similar to this candidate counts.
    """
    mask = candidate.found.mask
    share = resize_share(share, mask.shape)
    unsure, within, beyond = network_doubts(share, mask)
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
            -min(disputed_share(candidate, others, share) / MOST_MISJUDGED, 1.0),
            min(0.0, float(np.log(bulk_px / BULKY))),
            float(not candidate.by_network),
        ]
    )


def _difference(share: float) -> float:
    """Return the doubt of a difference given as a share of the mask's area: 0 for none, growing with its logarithm."""
    return float(np.log1p(min(share, 1.0) / LEAST_DIFFERENCE))


def probability(values: np.ndarray) -> float:
    """Return the probability in [0, 1] that a mask with these ``features`` is right: the model times ``unfitted_factor``."""
    bias, weights = _weights()
    return float(unfitted_factor(values) / (1 + np.exp(-np.clip(bias + weights @ values, -30, 30))))


def unfitted_factor(values: np.ndarray) -> float:
    """Return the factor in [0, 1] of two doubts that are too rare in the composites to be fitted.

    They are ``kept`` (a part in focus may be lost, or a hole filled) and ``solid`` (background may be visible through the
    mask).
    """
    return float((1 + values[FEATURES.index("kept")]) * np.exp(values[FEATURES.index("solid")]))


def log_odds_costs(values: np.ndarray) -> dict[str, float]:
    """Return the cost in log-odds of each feature except ``made_by_rules``, compared with the feature's best value."""
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
