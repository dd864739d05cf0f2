"""Tell whether a cut-out has the outline of a template: evidence for a mask that comes from none of the photo's colours."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from manitwin.models.generators.templates.fitting.fit import fit, kinds_of, template_for

MOST_OUTLINE, LEAST_IOU = 0.001, 0.9
"""The mean distance of the outlines, of the box's side, and the overlap of the areas."""


def template_outline_check(name: str | None, focal_mm: float | None = None) -> Callable[[np.ndarray], bool] | None:
    """Return what tells of a cut-out ``rgba (H, W, 4) uint8`` whether its outline is that of a template of this name.

    ``focal_mm`` is the lens as 35 mm equivalent where it is known. None where there is no template of that name.
    """
    template = template_for(name)
    if template is None:
        return None
    category, kinds = template.category, kinds_of(template.category, name)

    def explains(rgba: np.ndarray) -> bool:
        found = fit(category, rgba, or_of=kinds, focal_mm=focal_mm)
        return found is not None and found.residual.outline <= MOST_OUTLINE and found.residual.iou >= LEAST_IOU

    return explains
