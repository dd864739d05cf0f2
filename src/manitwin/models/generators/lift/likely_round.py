"""Decision whether an unnamed object is round about its length, from its probable names and its silhouette.

A single guess is often wrong but has the right shape: a bottle taken for a screwdriver is round, as both are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np

from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.generators.lift.hint import is_cylinder
from manitwin.models.generators.lift.roundness import ROUND_SHARE
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.fit import build_fitted_object, template_for

LEAST_SHARE, LEAST_SAID = 0.5, 0.1
"""Minimum share of round objects in the probability of the candidate names, and minimum of that probability."""
LEAST_SOLIDITY, LEAST_MIRROR_IOU = 0.85, 0.8
"""Limits for the silhouette of a single body that is about symmetric, within the accuracy of a mask."""


def is_likely_round(likely: Sequence[tuple[str, float]], silhouette: Mapping[str, float]) -> bool:
    """Tell whether most of the ``likely`` names (name, probability) are of objects that are round about their length.

    ``silhouette`` has the scores of the silhouette (``Silhouette.scores``), which must be possible for such an object.
    """
    if silhouette["solidity"] < LEAST_SOLIDITY or silhouette["mirror_iou"] < LEAST_MIRROR_IOU or silhouette["holes"]:
        return False
    said = sum(probability for _, probability in likely)
    round_things = sum(probability for name, probability in likely if _is_round_thing(name))
    return said >= LEAST_SAID and round_things >= LEAST_SHARE * said


def _is_round_thing(name: str) -> bool:
    template = template_for(name)
    if template is not None:
        return _is_round_template(template.category)
    prior = find_prior(name)
    return is_cylinder(name) or (prior is not None and prior.shape == "bottle")


@cache
def _is_round_template(category: str) -> bool:
    """Tell whether a template with typical measures is equally thick in both directions across its length."""
    template = load_templates()[category]
    thin_m, thick_m, _ = np.sort(
        np.ptp(build_fitted_object(template, template.typical_measures()).mesh.vertices, axis=0)
    )
    return bool(thick_m - thin_m <= ROUND_SHARE * thick_m)
