"""Shape of an unnamed object: a template of a probable name, a plain solid, a body of revolution, or the lifted silhouette.

A classifier's guess that is too uncertain to be a name only proposes shapes. The shape that best explains silhouette, inner
edges and shading is chosen, whatever its name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.errors import Rejected
from manitwin.models.generators.lift.end_on import CLEARLY_BETTER_FACTOR, DISC_ELLIPSE_IOU, is_elliptical_end_view
from manitwin.models.generators.lift.hint import ShapeHint
from manitwin.models.generators.lift.lifting import LiftedObject, lift
from manitwin.models.generators.lift.likely_round import is_likely_round
from manitwin.models.generators.lift.plain_solids import (
    PRIMITIVES,
    PlainSolids,
    explains_closely,
    is_preferred_to_lifted,
)
from manitwin.models.generators.lift.turned_solid import turned_solid
from manitwin.models.generators.templates.fitting.fit import TemplateFit, fit, template_for

LEAST_LIKELY = 0.1
"""Minimum probability of a name whose template is tried."""
NAMELESS_IOU, NAMELESS_OUTLINE = 0.92, 0.0045
"""Limits for the template of a merely probable name, stricter than for a given name (``LEAST_IOU``, ``MOST_OUTLINE``)."""
TEMPLATE_SOURCE = "template of a likely name fitted to the photo"
PLAIN_SOLID_SOURCE = "plain solid fitted to the photo"
REVOLUTION_SOURCE = "body of revolution fitted to the photo"
LIKELY_NAME_BONUS = 0.01
"""Bonus in ``Residual.cost`` of a probable name's template over a body of revolution that explains the photo equally well."""
ROUND_SOLIDS = frozenset({"cylinder", "disc"})
"""Plain solids that are also bodies of revolution."""


@dataclass(frozen=True)
class UnnamedShape:
    """A solid fitted to a photo, known only by its shape: its primitive, and how it was found."""

    fitted: TemplateFit
    primitive: str
    source: str


def choose_unnamed_shape(
    rgba: np.ndarray, likely: Sequence[tuple[str, float]], focal_mm: float | None, plain: PlainSolids
) -> UnnamedShape | LiftedObject:
    """Return the shape of the object in ``rgba (H, W, 4) uint8``, whose alpha is the mask; raises Rejected if none explains it.

    A ``plain`` solid that explains the photo closely is used unless a template of the ``likely`` names (name, probability),
    or a body of revolution, explains it better; other plain solids only if they are preferred to the lifted solid. A lifted,
    standing body of revolution is fitted again with the camera's perspective. An inflated silhouette whose probable names are
    round is made as thick as it is wide. ``focal_mm`` is the 35 mm equivalent focal length, if known.
    """
    fitted = _best_template(rgba, likely, focal_mm)
    if plain.close_fit is not None and PRIMITIVES[plain.close_fit.category] not in ROUND_SOLIDS:
        return _choose_plain_or_template(fitted, plain.close_fit)
    try:
        lifted = lift(rgba, ShapeHint())
    except Rejected:
        if plain.close_fit is not None:
            return _choose_plain_or_template(fitted, plain.close_fit)
        # a silhouette that no solid explains may be an ellipse
        if fitted is None or not explains_more(fitted, DISC_ELLIPSE_IOU):
            raise
        return _template_shape(fitted)
    turned = _fit_revolution(rgba, lifted, focal_mm)
    if turned is not None:
        return _best_round(turned, fitted, plain)
    if plain.close_fit is not None:
        return _choose_plain_or_template(fitted, plain.close_fit)
    if fitted is not None and _is_preferred(fitted, lifted):
        return _template_shape(fitted)
    if plain.best_fit is not None and is_preferred_to_lifted(plain.best_fit, lifted.notes["primitive"]):
        return _plain_solid_shape(plain.best_fit)
    if lifted.notes["primitive"] == "inflation" and is_likely_round(likely, lifted.notes["silhouette"]):
        return lift(rgba, ShapeHint(round=True))
    return lifted


def explains_more(fitted: TemplateFit, simpler_iou: float) -> bool:
    """Tell whether a template leaves much less of the silhouette unexplained than a simpler solid with the given overlap."""
    return 1 - fitted.residual.iou < CLEARLY_BETTER_FACTOR * (1 - simpler_iou)


def _fit_revolution(rgba: np.ndarray, lifted: LiftedObject, focal_mm: float | None) -> TemplateFit | None:
    """Return the fitted body of revolution of a photo that was lifted to a standing one, else None.

    Handles are ignored if the body alone explains as much.
    """
    if "elevation_deg" not in lifted.notes:
        return None
    turned = turned_solid(rgba, focal_mm)
    handles = bool(lifted.notes["handles"])
    if turned is None or (handles and turned.residual.iou < lifted.explained.silhouette_iou):
        return None
    return turned


def _best_round(turned: TemplateFit, fitted: TemplateFit | None, plain: PlainSolids) -> UnnamedShape:
    """Return a body of revolution, or another solid that explains the photo better."""
    near = (
        plain.best_fit if plain.best_fit is not None and is_preferred_to_lifted(plain.best_fit, "revolution") else None
    )
    solid = plain.close_fit or near
    if solid is not None and (
        PRIMITIVES[solid.category] not in ROUND_SOLIDS or solid.residual.cost <= turned.residual.cost
    ):
        return _choose_plain_or_template(fitted, solid)
    if fitted is not None and fitted.residual.cost <= turned.residual.cost + LIKELY_NAME_BONUS:
        return _template_shape(fitted)
    return UnnamedShape(turned, "revolution", REVOLUTION_SOURCE)


def _choose_plain_or_template(fitted: TemplateFit | None, plain: TemplateFit) -> UnnamedShape:
    """Return a plain solid, or a template that explains the photo better."""
    if fitted is not None and fitted.residual.cost < plain.residual.cost:
        return _template_shape(fitted)
    return _plain_solid_shape(plain)


def _template_shape(fitted: TemplateFit) -> UnnamedShape:
    return UnnamedShape(fitted, f"shape of template:{fitted.category}", TEMPLATE_SOURCE)


def _plain_solid_shape(plain: TemplateFit) -> UnnamedShape:
    return UnnamedShape(plain, PRIMITIVES[plain.category], PLAIN_SOLID_SOURCE)


def _is_preferred(fitted: TemplateFit, lifted: LiftedObject) -> bool:
    """Tell whether a template is preferred to the lifted solid; an inflated silhouette has no explanatory value.

    Many flat objects seen at an angle look nearly like the front of a box with rounded corners or seen from nearby.
    """
    if lifted.notes["primitive"] == "box" and not explains_closely(fitted.residual):
        return False
    return lifted.notes["primitive"] == "inflation" or explains_more(fitted, lifted.explained.silhouette_iou)


def _best_template(rgba: np.ndarray, likely: Sequence[tuple[str, float]], focal_mm: float | None) -> TemplateFit | None:
    """Return the template of the ``likely`` names that explains the photo best; None if none explains it closely."""
    templates = [template_for(name) for name, probability in likely if probability >= LEAST_LIKELY]
    kinds = list(dict.fromkeys(template.category for template in templates if template is not None))
    found = fit(kinds[0], rgba, or_of=kinds[1:], focal_mm=focal_mm) if kinds else None
    if found is None or found.residual.iou < NAMELESS_IOU or found.residual.outline > NAMELESS_OUTLINE:
        return None
    # the end of any round object looks like a ball
    extents = np.ptp(found.made.mesh.vertices, axis=0)
    return None if is_elliptical_end_view(extents, found.view.object_to_camera[2], rgba) else found
