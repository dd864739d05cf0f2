"""Lifting of a matted photo to a closed, textured surface that rests on a flat face: choice of the primitive and the pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import cv2
import numpy as np

from manitwin.errors import Rejected
from manitwin.models.generators.lift.candidates import (
    CandidateSolid,
    MeasuredPhoto,
    box_candidate,
    choose_revolution_axis,
    inflation_candidate,
    side_view_revolution,
    standing_revolution,
)
from manitwin.models.generators.lift.end_on import DISC_ELLIPSE_IOU
from manitwin.models.generators.lift.hint import ShapeHint, hint_from_name
from manitwin.models.generators.lift.primitives import profile
from manitwin.models.generators.lift.residual import FitQuality
from manitwin.models.generators.lift.silhouette import CROP_SIDE_PX, Silhouette, analyse_silhouette
from manitwin.models.generators.lift.surface import LiftedSurface, align_footprint, assert_solid, normalised
from manitwin.models.generators.lift.texture import crop_object, paint_unseen

__all__ = ["LiftedObject", "ShapeHint", "choose_primitive", "hint_from_name", "lift"]

Primitive = Literal["revolution", "box", "inflation"]
LEAST_IOU = 0.8
"""Minimum overlap of a solid with the silhouette; rendered templates reach 0.93 and more."""

DISC_ELONGATION = 1.15
"""Minimum elongation of an ellipse (``DISC_ELLIPSE_IOU``) that is not a circle."""


@dataclass(frozen=True)
class LiftedObject:
    """A solid in the glTF frame (Y up, front +Z, longest side 1, lowest point y = 0), its textures and notes.

    ``texture (H, W, 3)`` is the photo, for the visible surface; ``unseen (h, w, 3)``, of the same rectangle, is for the rest.
    ``explained`` tells how well the solid explains the mask and the inner edges of the photo.
    """

    surface: LiftedSurface
    texture: np.ndarray
    painted_texture: np.ndarray
    notes: dict[str, Any]
    explained: FitQuality


def lift(rgba: np.ndarray, hint: ShapeHint) -> LiftedObject:
    """Lift the object in ``rgba`` (H, W, 4) uint8, whose alpha is its mask, to a solid.

    Raises Rejected ``generator_failed`` for an object that is hollow from below, for an open container whose cavity cannot be
    inferred, if no solid explains the silhouette, and for an unnamed object with an elliptic silhouette.
    """
    crop = crop_object(rgba, CROP_SIDE_PX)
    height, width = crop.mask.shape
    photo = cv2.resize(crop.colours, (width, height), interpolation=cv2.INTER_AREA)
    view = MeasuredPhoto(crop, photo, choose_revolution_axis(analyse_silhouette(crop.mask), hint))
    primitive, made = _simplest_solid(view, hint)
    askew = primitive == "inflation" and made.notes["rests"] == "lying"
    surface = normalised(align_footprint(made.surface) if askew else made.surface)
    assert_solid(surface)
    notes = {
        "primitive": primitive,
        "silhouette": view.silhouette.scores(),
        "axis_tilt_deg": round(view.silhouette.axis_tilt_deg, 1),
        "silhouette_iou": round(made.quality.silhouette_iou, 4),
        "edge_support": None if made.quality.edge_support is None else round(made.quality.edge_support, 4),
        **made.notes,
    }
    axis = view.silhouette if primitive == "revolution" else None
    return LiftedObject(surface, crop.colours, paint_unseen(crop, axis), notes, made.quality)


def _simplest_solid(view: MeasuredPhoto, hint: ShapeHint) -> tuple[Primitive, CandidateSolid]:
    """Return the simplest solid that explains the silhouette; raises Rejected if there is none."""
    if hint.hollow_below:
        raise Rejected(
            "generator_failed",
            "lift cannot make this: the object is hollow from below, which one outline does not show; choose another"
            " generator, or give a mesh",
            "generate",
        )
    if hint == ShapeHint() and _is_ellipse(view.silhouette):
        raise Rejected(
            "generator_failed",
            "the outline is an ellipse, which may be a disc seen at an angle or an egg; name the object with"
            " --name, or take the"
            " photo from the side",
            "generate",
        )
    turned = standing_revolution(view, hint, plain=choose_primitive(view.silhouette, hint) == "revolution")
    if turned is not None:
        return "revolution", turned
    primitive = choose_primitive(view.silhouette, hint)
    if hint.container and primitive != "revolution":
        raise Rejected(
            "generator_failed",
            "lift cannot make this open container: its outline is not that of a round one, with or without a"
            " handle, and one outline does not show the shape of another cavity; choose another generator, or give"
            " a mesh",
            "generate",
        )
    made = {"revolution": side_view_revolution, "box": box_candidate, "inflation": inflation_candidate}[primitive](
        view, hint
    )
    if made.quality.silhouette_iou < LEAST_IOU:
        raise Rejected(
            "generator_failed",
            f"lift found no solid that explains the photo: the best one, by {primitive}, overlaps with"
            f" {made.quality.silhouette_iou:.0%} of the outline (at least {LEAST_IOU:.0%}); choose another generator",
            "generate",
        )
    return primitive, made


def _is_ellipse(silhouette: Silhouette) -> bool:
    return silhouette.ellipse_iou >= DISC_ELLIPSE_IOU and silhouette.elongation >= DISC_ELONGATION


def choose_primitive(silhouette: Silhouette, hint: ShapeHint) -> Primitive:
    """Choose the simplest solid that has this silhouette.

    Solids of revolution have a mirror axis and filled rows across it; a shape that is wide only on a short stretch (a
    spatula, a squeegee) is flat rather than round. A box has a rectangular silhouette. All others are inflated.
    """
    whole = silhouette.holes == 0
    if whole and not hint.round and silhouette.rectangle_iou > (0.88 if hint.boxy else 0.955):
        return "box"
    convex = silhouette.solidity > 0.95
    symmetric = silhouette.mirror_iou > (0.90 if convex else 0.93) and silhouette.row_fill > 0.985
    if whole and symmetric and not hint.flat and not hint.boxy and _is_revolution(silhouette):
        return "revolution"
    return "inflation"


def _is_revolution(silhouette: Silhouette) -> bool:
    if silhouette.solidity > 0.8:
        return True
    _, radii = profile(silhouette)
    wide = np.concatenate([[0], radii > 0.5 * radii.max(), [0]]).astype(int)
    starts, ends = np.nonzero(np.diff(wide) == 1)[0], np.nonzero(np.diff(wide) == -1)[0]
    return bool((ends - starts).max() > 4 * radii.max())
