"""Detection of solids fitted to a silhouette that shows only the end of an object, seen at an angle.

A glass, a jar and a bottle from above have the ellipse of the rim as silhouette. A long body that points towards the camera
has nearly the same silhouette, so a solid with unusual dimensions fits, although its length is not visible in the photo.
"""

from __future__ import annotations

import numpy as np

from manitwin.errors import Rejected
from manitwin.models.annotators.descriptions import article
from manitwin.models.generators.lift.silhouette import CROP_SIDE_PX, analyse_silhouette
from manitwin.models.generators.lift.texture import crop_object

DISC_ELLIPSE_IOU = 0.965
"""Minimum overlap of an elliptic silhouette.

All rendered templates that reach it without being circular are discs seen at an angle.
"""
CLEARLY_BETTER_FACTOR = 0.5
"""Factor on the unexplained part of a silhouette, compared with a simpler shape (body of revolution, box or ellipse).

It is small because a can has nearly the silhouette of a bucket, and a plate that of a pan with its handle behind it.
"""
LONG_ASPECT_RATIO = 1.2
"""Minimum ratio of the longest to the second side of an object whose end does not show its length."""


def reject_end_view(
    extents: np.ndarray, toward_camera: np.ndarray, silhouette_iou: float, rgba: np.ndarray, category: str
) -> None:
    """Reject a solid fitted to the end of an object of this ``category`` in ``rgba (H, W, 4) uint8``.

    This is the case if the camera looks along the object's length rather than across it, and an ellipse leaves much less of
    the mask (alpha) unexplained than the solid, whose overlap is ``silhouette_iou``. ``extents (3,)`` are the solid's sides,
    and ``toward_camera (3,)`` is the unit vector to the camera in the solid's axes. Raises Rejected ``generator_failed``.
    """
    ellipse_iou = _end_ellipse_iou(extents, toward_camera, rgba)
    if ellipse_iou is None or 1 - ellipse_iou > CLEARLY_BETTER_FACTOR * (1 - silhouette_iou):
        return
    raise Rejected(
        "generator_failed",
        f"the outline is an ellipse, as that of a rim is which is seen at an angle, and hardly that of {article(category)}"
        f" {category}: how long it is does not show; take the photo from the side",
        "generate",
    )


def is_elliptical_end_view(extents: np.ndarray, toward_camera: np.ndarray, rgba: np.ndarray) -> bool:
    """Tell whether the camera looks along the length of a solid, as in ``reject_end_view``, and the silhouette is an ellipse.

    A ball has that silhouette as well, so it is no evidence that an unnamed object is long, however well a long solid fits.
    """
    return _end_ellipse_iou(extents, toward_camera, rgba) is not None


def _end_ellipse_iou(extents: np.ndarray, toward_camera: np.ndarray, rgba: np.ndarray) -> float | None:
    """Return the overlap of an ellipse with the end view of a long object; None for other views, shapes or silhouettes."""
    shorter, longest = np.argsort(extents)[1:]
    is_long = extents[longest] >= LONG_ASPECT_RATIO * extents[shorter]
    if not is_long or abs(toward_camera[longest]) < np.sqrt(0.5):
        return None
    ellipse_iou = analyse_silhouette(crop_object(rgba, CROP_SIDE_PX).mask).ellipse_iou
    return ellipse_iou if ellipse_iou >= DISC_ELLIPSE_IOU else None
