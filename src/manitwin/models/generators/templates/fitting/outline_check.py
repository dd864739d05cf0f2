"""Check whether a matte has the silhouette of a template, as evidence independent of the photo's colours."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from manitwin.models.generators.templates.fitting.fit import alternative_categories, fit, template_for

MOST_OUTLINE, LEAST_IOU = 0.001, 0.9
"""Limits on the mean contour distance, relative to the box side, and on the overlap."""


def template_outline_check(name: str | None, focal_mm: float | None = None) -> Callable[[np.ndarray], bool] | None:
    """Return a function that checks whether a matte ``rgba (H, W, 4) uint8`` has the silhouette of the named template.

    ``focal_mm`` is the focal length (35 mm equivalent), if known. Returns None if there is no template of that name.
    """
    template = template_for(name)
    if template is None:
        return None
    category, kinds = template.category, alternative_categories(template.category, name)

    def explains(rgba: np.ndarray) -> bool:
        found = fit(category, rgba, or_of=kinds, focal_mm=focal_mm)
        return found is not None and found.residual.outline <= MOST_OUTLINE and found.residual.iou >= LEAST_IOU

    return explains
