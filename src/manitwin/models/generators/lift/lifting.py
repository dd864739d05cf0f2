"""Lift a matted photo to a closed, textured surface that rests on a flat face: the choice of the primitive, and how it lies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from manitwin.errors import Rejected
from manitwin.models.annotators.priors import lookup
from manitwin.models.generators.lift.inflation import inflate
from manitwin.models.generators.lift.primitives import DEPTH_SHARE, make_box, profile, revolve, trim_caps
from manitwin.models.generators.lift.silhouette import CROP_SIDE_PX, Silhouette, analyse_silhouette
from manitwin.models.generators.lift.surface import (
    TILTED_TIP_ANGLE_DEG,
    UPRIGHT_TIP_ANGLE_DEG,
    LiftedSurface,
    assert_solid,
    laid,
    laid_round,
    normalised,
    stood,
    tip_angle_deg,
)
from manitwin.models.generators.lift.texture import crop_object, paint_unseen

Primitive = Literal["revolution", "box", "inflation"]
_FLAT_BOX_DEPTH_SHARE = 0.12  # of the shorter side: a book, a tray
_WALL_SHARE = 0.05  # of the radius: the wall of a hollowed container
_COMPACT = (
    1.5  # round things no longer than this are set on their base, whatever else is usual: it is flat, they do not roll
)
_RELIEF_RISE = 1.5  # a bar of radius r lies as a relief this many r high: between a half bar and a whole one


@dataclass(frozen=True)
class ShapeHint:
    """``stands``: put down upright (None: unknown); ``container``: open at the top; the others describe its shape."""

    stands: bool | None = None
    container: bool = False
    round: bool = False
    boxy: bool = False
    flat: bool = False


def hint_from_name(name: str | None) -> ShapeHint:
    """Return the hint of the prior that ``name`` finds; an empty hint where it finds none."""
    prior = lookup(name)
    if prior is None:
        return ShapeHint()
    words = prior.shape.replace("-", " ").split()
    return ShapeHint(
        stands=prior.stands,
        container=prior.container,
        round=bool({"cylindrical", "round", "bottle", "bowl"} & set(words)),
        boxy=bool({"box", "rectangular", "block"} & set(words)),
        flat=bool({"flat", "shallow"} & set(words)),
    )


@dataclass(frozen=True)
class Lifted:
    """A solid in glTF's frame (Y up, front +Z, longest side 1, lowest point y = 0), its textures and how it was made.

    ``texture (H, W, 3)`` is the photo's, for what it shows; ``unseen (h, w, 3)``, of the same rectangle, is for the rest.
    """

    surface: LiftedSurface
    texture: np.ndarray
    unseen: np.ndarray
    notes: dict[str, Any]


def lift(rgba: np.ndarray, hint: ShapeHint) -> Lifted:
    """Lift the object in ``rgba`` (H, W, 4) uint8, whose alpha is its mask, to a solid.

    Raises Rejected ``generator_failed`` for an open container that is not seen from the side: its hollow would be filled.
    """
    crop = crop_object(rgba, CROP_SIDE_PX)
    silhouette = analyse_silhouette(crop.mask)
    primitive = choose_primitive(silhouette, hint)
    if hint.container and primitive != "revolution":
        raise Rejected(
            "generator_failed",
            "lift cannot make this open container: its outline is not that of a round one seen from the side, and one outline"
            " says nothing of the hollow; choose another generator, or give a mesh",
            "generate",
        )
    make = {"revolution": _revolved, "box": _boxed, "inflation": _inflated}[primitive]
    surface, rest = make(silhouette, hint)
    surface = normalised(surface)
    assert_solid(surface)
    notes = {
        "primitive": primitive,
        "silhouette": silhouette.scores(),
        "axis_tilt_deg": round(silhouette.axis_tilt_deg, 1),
        **rest,
    }
    axis = silhouette if primitive == "revolution" else None
    return Lifted(surface, crop.colours, paint_unseen(crop, axis), notes)


def choose_primitive(silhouette: Silhouette, hint: ShapeHint) -> Primitive:
    """Choose the simplest solid that has this outline.

    Solids of revolution have a mirror axis and filled rows across it; what is wide on a short stretch only (a spatula, a
    squeegee) is flat rather than round. A box has the outline of a rectangle. All else is inflated.
    """
    whole = silhouette.holes == 0
    if whole and not hint.round and silhouette.rectangle_iou > (0.88 if hint.boxy else 0.955):
        return "box"
    convex = silhouette.solidity > 0.95
    symmetric = silhouette.mirror_iou > (0.90 if convex else 0.93) and silhouette.row_fill > 0.985
    if whole and symmetric and not hint.flat and not hint.boxy and _is_turned(silhouette):
        return "revolution"
    return "inflation"


def _is_turned(silhouette: Silhouette) -> bool:
    if silhouette.solidity > 0.8:
        return True
    _, radii = profile(silhouette)
    wide = np.concatenate([[0], radii > 0.5 * radii.max(), [0]]).astype(int)
    starts, ends = np.nonzero(np.diff(wide) == 1)[0], np.nonzero(np.diff(wide) == -1)[0]
    return bool((ends - starts).max() > 4 * radii.max())


def _revolved(silhouette: Silhouette, hint: ShapeHint) -> tuple[LiftedSurface, dict[str, Any]]:
    tilt = silhouette.axis_tilt_deg
    rows, radii = profile(silhouette)
    third = len(radii) // 3
    # a thing that lies in the photo stands on its wider end
    upside_down = abs(tilt) > 45 and radii[:third].mean() > radii[-third:].mean()
    rows, radii = trim_caps(rows, radii, base_at_top=upside_down)
    open_top = hint.container and not upside_down and radii[: max(3, len(radii) // 20)].mean() > 0.6 * radii.max()
    surface = revolve(silhouette, rows, radii, wall_px=_WALL_SHARE * radii.max() if open_top else None)
    if upside_down:
        surface = surface.moved(np.diag([-1.0, -1.0, 1.0]), np.zeros(3))
    least = UPRIGHT_TIP_ANGLE_DEG if abs(tilt) < 20 else TILTED_TIP_ANGLE_DEG
    stands = hint.stands if hint.stands is not None else tip_angle_deg(surface) >= least
    if stands or silhouette.elongation < _COMPACT:
        return surface, {"rests": "standing", "hollow": bool(open_top)}
    leaning = np.radians(tilt + (180 if upside_down else 0))
    turn = np.array([[np.cos(leaning), np.sin(leaning), 0], [-np.sin(leaning), np.cos(leaning), 0], [0, 0, 1]])
    return laid_round(surface.moved(turn, np.zeros(3))), {"rests": "lying", "hollow": bool(open_top)}


def _boxed(silhouette: Silhouette, hint: ShapeHint) -> tuple[LiftedSurface, dict[str, Any]]:
    flat = hint.flat or hint.stands is False
    share = _FLAT_BOX_DEPTH_SHARE if flat else DEPTH_SHARE
    surface = make_box(silhouette, depth_share=share)
    if flat:
        return laid(surface), {"rests": "lying", "depth_share": share}
    return surface, {"rests": "standing", "depth_share": share}


def _inflated(silhouette: Silhouette, hint: ShapeHint) -> tuple[LiftedSurface, dict[str, Any]]:
    limit = _depth_limit_px(silhouette, hint)
    sturdy = silhouette.elongation < 2.5 and not (silhouette.holes and silhouette.solidity < 0.6)
    if hint.stands or (hint.stands is None and sturdy):
        body = inflate(silhouette.mask, depth_limit_px=limit, rise=1.0, flat_back=False)
        standing = stood(body, 2.0 if hint.stands else UPRIGHT_TIP_ANGLE_DEG)
        if standing is not None:
            return standing, {"rests": "standing", "depth_limit": _share(limit, silhouette)}
    relief = inflate(silhouette.mask, depth_limit_px=limit, rise=_RELIEF_RISE, flat_back=True)
    return laid(relief), {"rests": "lying", "depth_limit": _share(limit, silhouette)}


def _depth_limit_px(silhouette: Silhouette, hint: ShapeHint) -> float | None:
    """Return how far a body may rise: flat things are as thick everywhere as where they are typical.

    Nothing in one outline tells a flat head from a round one: slender things get the mean of both.
    """
    typical, largest = silhouette.typical_radius_px, silhouette.largest_radius_px
    if hint.flat or silhouette.holes:
        return 1.15 * typical
    if silhouette.elongation > 2.5:
        return float(np.sqrt(typical * largest))
    return None if hint.round else 0.6 * largest


def _share(limit_px: float | None, silhouette: Silhouette) -> float | None:
    return None if limit_px is None else round(limit_px / max(silhouette.mask.shape), 4)
