"""Whether a solid was fitted to an outline that is no more than its end, seen at an angle.

A glass, a jar and a bottle from above are an ellipse: that of the rim. A long body that is turned towards the camera nearly has
this outline too, so that a solid of unusual measures fits; but what of its length the photo shows is not seen.
"""

from __future__ import annotations

import numpy as np

from manitwin.errors import Rejected
from manitwin.models.annotators.words import article
from manitwin.models.generators.lift.silhouette import CROP_SIDE_PX, analyse_silhouette
from manitwin.models.generators.lift.texture import crop_object

DISC_ELLIPSE_IOU = 0.965
"""From here on an outline is an ellipse: of rendered templates all that have one and are no circle are discs seen at an angle."""
CLEARLY_LESS = 0.5
"""Of what a simpler shape leaves unexplained of an outline, a body of revolution, a box or an ellipse: a can has nearly the
outline of a bucket, and a plate that of a pan with its handle behind it."""
LONG = 1.2
"""Longest side over the second from which on a thing has a length that an end does not show."""


def reject_end_on(
    extents: np.ndarray, toward_camera: np.ndarray, silhouette_iou: float, rgba: np.ndarray, category: str
) -> None:
    """Reject a solid that was fitted to what is the end of a thing of this ``category`` in ``rgba (H, W, 4) uint8``.

    That is where the camera looks along its length rather than across, and an ellipse leaves much less unexplained of the mask,
    which is the alpha, than the solid, which overlaps with it by ``silhouette_iou``. ``extents (3,)`` are the solid's sides,
    ``toward_camera (3,)`` is the unit vector to the camera along their axes. Raises Rejected ``generator_failed``.
    """
    ellipse_iou = _end_ellipse_iou(extents, toward_camera, rgba)
    if ellipse_iou is None or 1 - ellipse_iou > CLEARLY_LESS * (1 - silhouette_iou):
        return
    raise Rejected(
        "generator_failed",
        f"the outline is an ellipse, as that of a rim is which is seen at an angle, and hardly that of {article(category)}"
        f" {category}: how long it is does not show; take the photo from the side",
        "generate",
    )


def shows_no_more_than_an_end(extents: np.ndarray, toward_camera: np.ndarray, rgba: np.ndarray) -> bool:
    """Tell whether of a solid as in ``reject_end_on`` the camera looks along its length and the outline is an ellipse.

    A ball has that outline as well: what nobody has named is no long thing by it, however closely it goes with one.
    """
    return _end_ellipse_iou(extents, toward_camera, rgba) is not None


def _end_ellipse_iou(extents: np.ndarray, toward_camera: np.ndarray, rgba: np.ndarray) -> float | None:
    """Return how far an ellipse explains what is seen of a long thing along its length; None where it does not, or across."""
    shorter, longest = np.argsort(extents)[1:]
    is_long = extents[longest] >= LONG * extents[shorter]
    if not is_long or abs(toward_camera[longest]) < np.sqrt(0.5):
        return None
    ellipse_iou = analyse_silhouette(crop_object(rgba, CROP_SIDE_PX).mask).ellipse_iou
    return ellipse_iou if ellipse_iou >= DISC_ELLIPSE_IOU else None
