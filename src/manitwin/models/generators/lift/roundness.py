"""Roundness of fitted templates: a template that is not round contradicts a lifted body of revolution."""

from __future__ import annotations

import numpy as np

from manitwin.models.generators.lift.end_on import LONG_ASPECT_RATIO
from manitwin.models.generators.templates.fitting.fit import TemplateFit

ROUND_SHARE = 0.02
"""Maximum difference of width and depth over the larger one, for a body of revolution without a handle."""


def is_round(fitted: TemplateFit) -> bool:
    """Tell whether it is as wide as deep, so that it has no handle."""
    width_m, depth_m, _ = np.ptp(fitted.made.mesh.vertices, axis=0)
    return bool(abs(width_m - depth_m) <= ROUND_SHARE * max(width_m, depth_m))


def is_round_along(fitted: TemplateFit) -> bool:
    """Tell whether it is long and equally thick in both directions across, as a lying screwdriver or an egg."""
    thin_m, thick_m, long_m = np.sort(np.ptp(fitted.made.mesh.vertices, axis=0))
    return bool(long_m >= LONG_ASPECT_RATIO * thick_m and thick_m - thin_m <= ROUND_SHARE * thick_m)
