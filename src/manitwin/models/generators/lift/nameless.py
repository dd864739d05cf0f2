"""Shape of an unnamed object: a template of a probable name, a plain solid, a body of revolution, or the lifted silhouette.

A classifier's guess that is too uncertain to be a name only proposes shapes. The shape that best explains silhouette, inner
edges and shading is chosen, whatever its name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.errors import Rejected
from manitwin.models.generators.lift.end_on import CLEARLY_LESS, DISC_ELLIPSE_IOU, shows_no_more_than_an_end
from manitwin.models.generators.lift.hint import ShapeHint
from manitwin.models.generators.lift.lifting import Lifted, lift
from manitwin.models.generators.lift.likely_round import is_likely_round
from manitwin.models.generators.lift.plain_solids import PRIMITIVES, PlainSolids, explains_closely, is_rather
from manitwin.models.generators.lift.turned_solid import turned_solid
from manitwin.models.generators.templates.fitting.fit import Fitted, fit, template_for

LEAST_LIKELY = 0.1
"""Minimum probability of a name whose template is tried."""
NAMELESS_IOU, NAMELESS_OUTLINE = 0.92, 0.0045
"""Limits for the template of a merely probable name, stricter than for a given name (``LEAST_IOU``, ``MOST_OUTLINE``)."""
OF_LIKELY_NAMES = "template of a likely name fitted to the photo"
OF_PLAIN_SOLIDS = "plain solid fitted to the photo"
OF_TURNED_SOLIDS = "body of revolution fitted to the photo"
SAID_COST = 0.01
"""Bonus in ``Residual.cost`` of a probable name's template over a body of revolution that explains the photo equally well."""
ROUND = frozenset({"cylinder", "disc"})
"""Plain solids that are also bodies of revolution."""


@dataclass(frozen=True)
class Alone:
    """A solid fitted to a photo, known only by its shape: its primitive, and how it was found."""

    fitted: Fitted
    primitive: str
    source: str


def shape_without_name(
    rgba: np.ndarray, likely: Sequence[tuple[str, float]], focal_mm: float | None, plain: PlainSolids
) -> Alone | Lifted:
    """Return the shape of the object in ``rgba (H, W, 4) uint8``, whose alpha is the mask; raises Rejected if none explains it.

    A ``plain`` solid that explains the photo closely is used unless a template of the ``likely`` names (name, probability),
    or a body of revolution, explains it better; other plain solids only if they are preferred to the lifted solid. A lifted,
    standing body of revolution is fitted again with the camera's perspective. An inflated silhouette whose probable names are
    round is made as thick as it is wide. ``focal_mm`` is the 35 mm equivalent focal length, if known.
    """
    fitted = _best_template(rgba, likely, focal_mm)
    if plain.close is not None and PRIMITIVES[plain.close.category] not in ROUND:
        return _cheaper(fitted, plain.close)
    try:
        lifted = lift(rgba, ShapeHint())
    except Rejected:
        if plain.close is not None:
            return _cheaper(fitted, plain.close)
        # a silhouette that no solid explains may be an ellipse
        if fitted is None or not explains_more(fitted, DISC_ELLIPSE_IOU):
            raise
        return _of_likely_name(fitted)
    turned = _turned(rgba, lifted, focal_mm)
    if turned is not None:
        return _best_round(turned, fitted, plain)
    if plain.close is not None:
        return _cheaper(fitted, plain.close)
    if fitted is not None and _is_preferred(fitted, lifted):
        return _of_likely_name(fitted)
    if plain.nearest is not None and is_rather(plain.nearest, lifted.notes["primitive"]):
        return _plain(plain.nearest)
    if lifted.notes["primitive"] == "inflation" and is_likely_round(likely, lifted.notes["silhouette"]):
        return lift(rgba, ShapeHint(round=True))
    return lifted


def explains_more(fitted: Fitted, simpler_iou: float) -> bool:
    """Tell whether a template leaves much less of the silhouette unexplained than a simpler solid with the given overlap."""
    return 1 - fitted.residual.iou < CLEARLY_LESS * (1 - simpler_iou)


def _turned(rgba: np.ndarray, lifted: Lifted, focal_mm: float | None) -> Fitted | None:
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


def _best_round(turned: Fitted, fitted: Fitted | None, plain: PlainSolids) -> Alone:
    """Return a body of revolution, or another solid that explains the photo better."""
    near = plain.nearest if plain.nearest is not None and is_rather(plain.nearest, "revolution") else None
    solid = plain.close or near
    if solid is not None and (PRIMITIVES[solid.category] not in ROUND or solid.residual.cost <= turned.residual.cost):
        return _cheaper(fitted, solid)
    if fitted is not None and fitted.residual.cost <= turned.residual.cost + SAID_COST:
        return _of_likely_name(fitted)
    return Alone(turned, "revolution", OF_TURNED_SOLIDS)


def _cheaper(fitted: Fitted | None, plain: Fitted) -> Alone:
    """Return a plain solid, or a template that explains the photo better."""
    if fitted is not None and fitted.residual.cost < plain.residual.cost:
        return _of_likely_name(fitted)
    return _plain(plain)


def _of_likely_name(fitted: Fitted) -> Alone:
    return Alone(fitted, f"shape of template:{fitted.category}", OF_LIKELY_NAMES)


def _plain(plain: Fitted) -> Alone:
    return Alone(plain, PRIMITIVES[plain.category], OF_PLAIN_SOLIDS)


def _is_preferred(fitted: Fitted, lifted: Lifted) -> bool:
    """Tell whether a template is preferred to the lifted solid; an inflated silhouette has no explanatory value.

    Many flat objects seen at an angle look nearly like the front of a box with rounded corners or seen from nearby.
    """
    if lifted.notes["primitive"] == "box" and not explains_closely(fitted.residual):
        return False
    return lifted.notes["primitive"] == "inflation" or explains_more(fitted, lifted.explained.silhouette_iou)


def _best_template(rgba: np.ndarray, likely: Sequence[tuple[str, float]], focal_mm: float | None) -> Fitted | None:
    """Return the template of the ``likely`` names that explains the photo best; None if none explains it closely."""
    templates = [template_for(name) for name, probability in likely if probability >= LEAST_LIKELY]
    kinds = list(dict.fromkeys(template.category for template in templates if template is not None))
    found = fit(kinds[0], rgba, or_of=kinds[1:], focal_mm=focal_mm) if kinds else None
    if found is None or found.residual.iou < NAMELESS_IOU or found.residual.outline > NAMELESS_OUTLINE:
        return None
    # the end of any round object looks like a ball
    extents = np.ptp(found.made.mesh.vertices, axis=0)
    return None if shows_no_more_than_an_end(extents, found.view.object_to_camera[2], rgba) else found
