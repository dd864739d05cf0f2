"""Say what a picture shows in a word of the priors, with a probability that was calibrated, or say that it is not known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.models.classifiers.efficientnet_lite import NAME, SIDE_PX, logits
from manitwin.models.classifiers.imagenet import load_limits, load_names
from manitwin.models.classifiers.object_pictures import object_pictures
from manitwin.twin.record_values import Estimate

TEMPERATURE = 0.9
"""The least log loss on either half of the templates' categories, rendered (benchmarks/naming.py)."""
LIKELIEST = 3


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


def classify(pictures: list[np.ndarray], min_probability: float) -> Named:
    """Name the object that pictures ``(H, W, 4) uint8`` show, alpha its matte, all of them of the same object.

    A name's probability is the sum over ImageNet's classes that it stands for, at a temperature (Guo et al. 2017, "On
    calibration of modern neural networks", eq. 9), averaged over pictures and backgrounds. It has to reach
    ``min_probability``, and more than a picture of any other thing has given that name: of most tools ImageNet has no class,
    and they are taken for a spatula or a can opener. Where no single name is likely enough, a wider word may be. Raises
    Unavailable without the classifier's weights.
    """
    looks = np.concatenate([object_pictures(rgba, SIDE_PX) for rgba in pictures])
    table = load_names()
    probabilities = softmax(logits(looks) / TEMPERATURE)
    names, general = probabilities @ table.members.T, probabilities @ table.general_members.T
    order = np.argsort(-names.mean(0), kind="stable")
    likeliest = tuple(_guess(table.names[i], names[:, i]) for i in order[:LIKELIEST])
    wider, limits = int(np.argmax(general.mean(0))), load_limits()
    for guess in (likeliest[0], _guess(table.general[wider], general[:, wider])):
        if guess.probability.value >= max(min_probability, limits[guess.name]):
            return Named(guess.name, guess.probability, likeliest)
    return Named(None, likeliest[0].probability, likeliest)


def softmax(values: np.ndarray) -> np.ndarray:
    """Return the probabilities of logits ``(N, K)``, in double precision."""
    values = values.astype(np.float64)
    powers = np.exp(values - values.max(axis=1, keepdims=True))
    return np.asarray(powers / powers.sum(axis=1, keepdims=True))


def _guess(name: str, probabilities: np.ndarray) -> Guess:
    low, high = float(probabilities.min()), float(probabilities.max())
    value = min(max(float(probabilities.mean()), low), high)  # a mean of equal numbers may be rounded out of them
    return Guess(name, Estimate(value=value, low=low, high=high, source=NAME))
