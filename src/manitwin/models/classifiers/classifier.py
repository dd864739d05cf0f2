"""Name what a picture shows by a word of the priors, with a calibrated probability, or say that it is not known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.models.classifiers.efficientnet_lite import NAME, SIDE_PX, logits
from manitwin.models.classifiers.imagenet import load_limits, load_names
from manitwin.models.classifiers.object_pictures import object_pictures
from manitwin.models.classifiers.size_evidence import size_likelihoods
from manitwin.twin.record_values import Estimate

TEMPERATURE = 0.9
"""The temperature with the least log loss on renders of either half of the templates' categories (benchmarks/naming.py)."""
LIKELIEST = 3
AND_SIZE = "+size"
"""Appended to the source of a probability that a known size has changed."""


@dataclass(frozen=True)
class Guess:
    """A name and its probability; the estimate's interval is that of the single pictures, ``source`` the classifier."""

    name: str
    probability: Estimate


@dataclass(frozen=True)
class Named:
    """What a thing is: ``name`` is None where no guess is likely enough; the ``likeliest`` are single names, not wider words."""

    name: str | None
    probability: Estimate
    likeliest: tuple[Guess, ...]


def classify(pictures: list[np.ndarray], min_probability: float, longest_m: float | None = None) -> Named:
    """Name the object that pictures ``(H, W, 4) uint8`` show, alpha its matte, all of them of the same object.

    A name's probability is the sum over ImageNet's classes that it stands for, at a temperature (Guo et al. 2017, "On
    calibration of modern neural networks", eq. 9), averaged over pictures and backgrounds; where it is known that the thing is
    ``longest_m`` long, times how usual that is of such things, and of anything else (Bayes' rule). It has to reach
    ``min_probability``, and more than a picture of any other thing has given that name: of most tools ImageNet has no class,
    and they are taken for a spatula or a can opener. Where no single name is likely enough, a wider word may be. Raises
    Unavailable without the classifier's weights.
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
        value = min(max(value, low), high)  # rounding may put the mean of equal numbers outside of their interval
        return Guess(name, Estimate(value=value, low=low, high=high, source=source))

    order = np.argsort(-names, kind="stable")
    likeliest = tuple(guess(table.names[i], float(names[i]), table.members[i]) for i in order[:LIKELIEST])
    wider, limits = int(np.argmax(general)), load_limits()
    widest = guess(table.general[wider], float(general[wider]), table.general_members[wider])
    for said in (likeliest[0], widest):
        if said.probability.value >= max(min_probability, limits[said.name]):
            return Named(said.name, said.probability, likeliest)
    return Named(None, likeliest[0].probability, likeliest)


def softmax(values: np.ndarray) -> np.ndarray:
    """Return the probabilities of logits ``(N, K)``, in double precision."""
    values = values.astype(np.float64)
    powers = np.exp(values - values.max(axis=1, keepdims=True))
    return np.asarray(powers / powers.sum(axis=1, keepdims=True))
