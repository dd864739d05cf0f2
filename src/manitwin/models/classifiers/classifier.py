"""Classification of a picture by a name from the priors with a calibrated probability, or as unknown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.models.classifiers.efficientnet_lite import NAME, SIDE_PX, logits
from manitwin.models.classifiers.imagenet import load_limits, load_names
from manitwin.models.classifiers.object_pictures import object_pictures
from manitwin.models.classifiers.size_evidence import size_likelihoods
from manitwin.twin.record_values import Estimate

TEMPERATURE = 0.9
"""Softmax temperature with the lowest log loss on renders of either half of the templates' categories (benchmarks/naming.py)."""
LIKELIEST = 3
AND_SIZE = "+size"
"""Suffix of a probability's source if a known size was taken into account."""


@dataclass(frozen=True)
class Guess:
    """A name and its probability.

    The interval of the estimate spans the values of the single pictures; its ``source`` is the classifier.
    """

    name: str
    probability: Estimate


@dataclass(frozen=True)
class Classification:
    """Result of a classification.

    ``name`` is None if no name is probable enough; ``likeliest`` has specific names, no general terms.
    """

    name: str | None
    probability: Estimate
    likeliest: tuple[Guess, ...]


def classify(pictures: list[np.ndarray], min_probability: float, longest_m: float | None = None) -> Classification:
    """Name the object shown in pictures ``(H, W, 4) uint8`` with its matte as alpha; all pictures show the same object.

    The probability of a name is the sum over the ImageNet classes that it covers, at a fixed temperature (Guo et al. 2017,
    "On calibration of modern neural networks", eq. 9), averaged over pictures and backgrounds. If the object's longest side
    ``longest_m`` is known, class probabilities are weighted by the likelihood of that size (Bayes' rule). A name is accepted
    if its probability reaches both ``min_probability`` and the highest probability that any picture of another object has
    given to that name: ImageNet has no classes for most tools and takes them for a spatula or a can opener. If no specific
    name is accepted, a general term may be. Raises Unavailable without the classifier's weights.
    """
    looks = np.concatenate([object_pictures(rgba, SIDE_PX) for rgba in pictures])
    table = load_names()
    weighted, source = softmax(logits(looks) / TEMPERATURE), NAME
    if longest_m is not None:
        weighted, source = weighted * size_likelihoods(longest_m), NAME + AND_SIZE
    each, mean = weighted / weighted.sum(1, keepdims=True), weighted.sum(0) / weighted.sum()
    names, general = mean @ table.members.T, mean @ table.general_members.T

    def guess(name: str, value: float, members: np.ndarray) -> Guess:
        of_pictures = each @ members
        low, high = float(of_pictures.min()), float(of_pictures.max())
        value = min(max(value, low), high)  # rounding may move the mean of equal numbers outside their interval
        return Guess(name, Estimate(value=value, low=low, high=high, source=source))

    order = np.argsort(-names, kind="stable")
    likeliest = tuple(guess(table.names[i], float(names[i]), table.members[i]) for i in order[:LIKELIEST])
    wider, limits = int(np.argmax(general)), load_limits()
    widest = guess(table.general[wider], float(general[wider]), table.general_members[wider])
    for said in (likeliest[0], widest):
        if said.probability.value >= max(min_probability, limits[said.name]):
            return Classification(said.name, said.probability, likeliest)
    return Classification(None, likeliest[0].probability, likeliest)


def softmax(values: np.ndarray) -> np.ndarray:
    """Return the probabilities of logits ``(N, K)``, in double precision."""
    values = values.astype(np.float64)
    powers = np.exp(values - values.max(axis=1, keepdims=True))
    return np.asarray(powers / powers.sum(axis=1, keepdims=True))
