"""The shape of what nobody has named: a template of a likely name, a plain solid, a body of revolution, or the outline lifted.

A classifier's guess that is too unsure to be a name chooses among shapes, and never against the picture: what explains outline,
inner edges and shading best is taken, whatever it is called.
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
"""Probability of a name below which its shape is not tried."""
NAMELESS_IOU, NAMELESS_OUTLINE = 0.92, 0.0045
"""A name that is only likely has to explain more than one that a person says (``LEAST_IOU``, ``MOST_OUTLINE``)."""
OF_LIKELY_NAMES = "template of a likely name fitted to the photo"
OF_PLAIN_SOLIDS = "plain solid fitted to the photo"
OF_TURNED_SOLIDS = "body of revolution fitted to the photo"
SAID_COST = 0.01
"""Of ``Residual.cost``: what a likely name speaks for its template beside a body of revolution that explains a photo as well."""
ROUND = frozenset({"cylinder", "disc"})
"""The plain solids that are bodies of revolution too."""


@dataclass(frozen=True)
class Alone:
    """A solid that was fitted to a photo, of which nothing is known but its shape: what it is, and how it was found."""

    fitted: Fitted
    primitive: str
    source: str


def shape_without_name(
    rgba: np.ndarray, likely: Sequence[tuple[str, float]], focal_mm: float | None, plain: PlainSolids
) -> Alone | Lifted:
    """Return the shape of what ``rgba (H, W, 4) uint8`` shows, whose alpha is the mask; raises Rejected where none explains it.

    A ``plain`` solid that explains the photo closely stands but for a template of the ``likely`` names, each with its
    probability, or a body of revolution that does so better; another one only where it explains the photo rather than what the
    outline is lifted to. What is lifted to a body of revolution that stands is fitted again with the camera's perspective; what
    is no such body by its outline, but likely has the name of something round, is as thick as it is wide.
    ``focal_mm`` is the lens as 35 mm equivalent, where it is known.
    """
    fitted = _best_template(rgba, likely, focal_mm)
    if plain.close is not None and PRIMITIVES[plain.close.category] not in ROUND:
        return _cheaper(fitted, plain.close)
    try:
        lifted = lift(rgba, ShapeHint())
    except Rejected:
        if plain.close is not None:
            return _cheaper(fitted, plain.close)
        if fitted is None or not explains_more(fitted, DISC_ELLIPSE_IOU):  # what no solid explains may be an ellipse
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
    """Tell whether a template leaves much less of the outline unexplained than a simpler solid of that overlap."""
    return 1 - fitted.residual.iou < CLEARLY_LESS * (1 - simpler_iou)


def _turned(rgba: np.ndarray, lifted: Lifted, focal_mm: float | None) -> Fitted | None:
    """Return the body of revolution of a photo that was lifted to one which stands in it; None where it was not.

    What sticks out beside the body is none where the body alone explains as much.
    """
    if "elevation_deg" not in lifted.notes:
        return None
    turned = turned_solid(rgba, focal_mm)
    handles = bool(lifted.notes["handles"])
    if turned is None or (handles and turned.residual.iou < lifted.explained.silhouette_iou):
        return None
    return turned


def _best_round(turned: Fitted, fitted: Fitted | None, plain: PlainSolids) -> Alone:
    """Return a body of revolution, or what explains the photo better than it."""
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
    """Whether a template is to be preferred to a solid that needs no name; an inflated outline explains nothing.

    The front of a box, its corners round or seen from near, is what many flat things seen at an angle nearly look like.
    """
    if lifted.notes["primitive"] == "box" and not explains_closely(fitted.residual):
        return False
    return lifted.notes["primitive"] == "inflation" or explains_more(fitted, lifted.explained.silhouette_iou)


def _best_template(rgba: np.ndarray, likely: Sequence[tuple[str, float]], focal_mm: float | None) -> Fitted | None:
    """Return the template of the ``likely`` names that explains the photo best; None where none does closely."""
    templates = [template_for(name) for name, probability in likely if probability >= LEAST_LIKELY]
    kinds = list(dict.fromkeys(template.category for template in templates if template is not None))
    found = fit(kinds[0], rgba, or_of=kinds[1:], focal_mm=focal_mm) if kinds else None
    if found is None or found.residual.iou < NAMELESS_IOU or found.residual.outline > NAMELESS_OUTLINE:
        return None
    # a ball goes with the end of any round thing
    extents = np.ptp(found.made.mesh.vertices, axis=0)
    return None if shows_no_more_than_an_end(extents, found.view.object_to_camera[2], rgba) else found
