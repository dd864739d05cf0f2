"""Candidate solids for a photo: bodies of revolution with handles, standing or lying, boxes, and inflated silhouettes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from manitwin.models.generators.lift.handles import handle_tubes
from manitwin.models.generators.lift.hint import ShapeHint
from manitwin.models.generators.lift.inflation import depth_limit_for_volume, inflate, round_fullness
from manitwin.models.generators.lift.primitives import DEPTH_SHARE, make_box, profile, revolve, trim_caps
from manitwin.models.generators.lift.residual import FitQuality, compute_fit_quality, parallel_camera
from manitwin.models.generators.lift.revolution import (
    WALL_SHARE,
    fit_elevation,
    half_widths,
    project_onto_photo,
    revolve_profile,
)
from manitwin.models.generators.lift.silhouette import Silhouette, about_perpendicular_axis, upright_transform
from manitwin.models.generators.lift.soles import inflate_on_soles
from manitwin.models.generators.lift.surface import (
    TILTED_TIP_ANGLE_DEG,
    UPRIGHT_TIP_ANGLE_DEG,
    LiftedSurface,
    bare_mesh,
    cut_standing_base,
    lay_on_back,
    lay_on_facet,
    tip_angle_deg,
)
from manitwin.models.generators.lift.texture import Crop

_FLAT_BOX_DEPTH_SHARE = 0.12  # of the shorter side, as for a book or a tray
_LEAST_FLAT_SHARE = 0.02  # a card is thinner, but collision hulls and grasps need some thickness
UPRIGHT_TILT_DEG = 20.0  # maximum tilt of the axis of an object that stands in the photo
LEANING_DEG = 3.0  # an object that leans more is revolved about its own axis, as if seen from the side
LEAST_BODY_SHARE = 0.55  # of the silhouette: minimum share of a round container's body, without handles and spouts
LEAST_TURNED_IOU, LEAST_MIRROR_IOU = 0.92, 0.9
_LONGER = 1.1  # minimum width over height for which the other mirror axis may be the axis of revolution
_RIM_RADIUS, _SHARP_RIM = 0.93, 0.24
"""A rim is sharp if less than 0.24 of the height has 0.93 of the largest radius or more.

The share is 0.37 for an ellipsoid, and 0.2 for a lemon revolved about the wrong axis.
"""
_SIMILAR_ENDS_SHARE = 0.15  # maximum difference of the mean radii of two similar ends, over the larger one
_CLEARLY_NEARER = 0.1  # difference of log volumes
LEAST_TIP_ANGLE_DEG = 5.0
LEAST_STATED_ANGLE_DEG = 2.0  # the same for an object that is known to stand
SLIGHT_CUTS = (0.015, 0.03)  # cuts of a rounded underside; higher cuts would remove feet
STANDING_CUTS = (0.05, 0.08, 0.12)  # shares of the height at which a flat base is tried
_SINGLE_BODY_SOLIDITY = (
    0.85  # minimum solidity of a single body; the thickness of a handle does not follow from a wide head
)
_KNOWN_DEPTH_RELIEF_RISE = 2.0  # for a body of known depth: a relief is as high as the whole body is deep
_RELIEF_RISE = 1.5  # height of a relief of a bar over its radius: between a half bar and a whole one
_COMPACT = 1.5
"""Maximum elongation of round objects that are set on their base regardless of their usual pose, so that they do not roll."""


@dataclass(frozen=True)
class MeasuredPhoto:
    """A photo with its measurements: the crop, its colours at the size of the mask, and the measured silhouette."""

    crop: Crop
    photo: np.ndarray
    silhouette: Silhouette

    def fit_quality(self, surface: LiftedSurface, elevation_deg: float = 0.0) -> FitQuality:
        """Compare a solid in the pixels of the crop with the photo."""
        shape = (self.crop.mask.shape[0], self.crop.mask.shape[1])
        camera = parallel_camera(shape, elevation_deg=elevation_deg)
        return compute_fit_quality(bare_mesh(surface), camera, self.crop.mask, self.photo)


@dataclass(frozen=True)
class CandidateSolid:
    """A solid in its resting pose, how well it explained the photo, and notes."""

    surface: LiftedSurface
    quality: FitQuality
    notes: dict[str, Any]


def choose_revolution_axis(silhouette: Silhouette, hint: ShapeHint) -> Silhouette:
    """Return the silhouette about the other mirror axis if that is the axis of revolution, for one that is symmetric about both.

    A lemon on its side would be a lens if it were revolved about the axis across it: with a sharp rim, which is rare, and
    with more than the volume of its category.
    """
    if hint.stands or hint.container or hint.flat or hint.boxy:
        return silhouette
    _, radii = profile(silhouette)
    height, width = float(len(radii)), 2 * float(radii.max())
    if width < _LONGER * height:
        return silhouette
    other = about_perpendicular_axis(silhouette)
    if other.mirror_iou < LEAST_MIRROR_IOU:
        return silhouette
    sharp = float((radii > _RIM_RADIUS * radii.max()).mean()) < _SHARP_RIM
    return other if sharp or _is_long_axis_likelier(height / width, hint) else silhouette


def _is_long_axis_likelier(flatness: float, hint: ShapeHint) -> bool:
    """Tell whether revolving about the long axis gives clearly a better volume for the category than about the short one."""
    if not hint.round or hint.volume_share is None:
        return False
    flat, long = (abs(float(np.log(np.pi / 6 * flatness**power / hint.volume_share))) for power in (1, 2))
    return long < flat - _CLEARLY_NEARER


def standing_revolution(view: MeasuredPhoto, hint: ShapeHint, *, plain: bool) -> CandidateSolid | None:
    """Return a body of revolution that stands in the photo, with its handles; None if it does not explain the silhouette.

    ``plain``: the silhouette alone suggests a body of revolution.
    """
    silhouette, mask = view.silhouette, view.crop.mask
    round_thing = hint.round or (hint.container and not hint.boxy)
    if hint.boxy or (hint.flat and not hint.container) or hint.stands is False:
        return None
    _, widths, _ = half_widths(mask)
    body_share = 2 * float(widths.sum()) / float(mask.sum())
    if body_share < (LEAST_BODY_SHARE if round_thing else 0.97):
        return None
    whole = silhouette.holes == 0 and body_share > 0.97
    if whole and not round_thing and not plain:
        return None
    if whole and not hint.container and abs(silhouette.axis_tilt_deg) > LEANING_DEG:
        return None
    turned, _ = fit_elevation(mask, view.photo, hollow=hint.container, handled=hint.container or silhouette.holes > 0)
    if not hint.container and turned.elevation_deg == 0:
        least = UPRIGHT_TIP_ANGLE_DEG if hint.stands is None else 0.0
        if tip_angle_deg(revolve_profile(turned)) < max(least, 1.0):
            return None
    wall_px = WALL_SHARE * float(turned.radii.max()) if hint.container else None
    tubes = handle_tubes(mask, turned)
    surface = revolve_profile(turned, wall_px=wall_px, tubes=tubes)
    found = view.fit_quality(surface, turned.elevation_deg)
    if found.silhouette_iou < LEAST_TURNED_IOU:
        return None
    notes = {
        "rests": "standing",
        "hollow": hint.container,
        "elevation_deg": round(turned.elevation_deg, 1),
        "handles": len(tubes),
    }
    return CandidateSolid(
        project_onto_photo(surface, (mask.shape[0], mask.shape[1]), turned.elevation_deg, turned.column_px),
        found,
        notes,
    )


def side_view_revolution(view: MeasuredPhoto, hint: ShapeHint) -> CandidateSolid:
    """Return a body of revolution about the silhouette's mirror axis, in any orientation, seen from the side."""
    silhouette = view.silhouette
    tilt = silhouette.axis_tilt_deg
    rows, radii = profile(silhouette)
    third = len(radii) // 3
    # an object that lies in the photo stands on its wider end
    first, last = float(radii[:third].mean()), float(radii[-third:].mean())
    upside_down = abs(tilt) > 45 and first > last
    # such an object stands on neither end
    lies = abs(tilt) > 45 and hint.stands is False and abs(first - last) < _SIMILAR_ENDS_SHARE * max(first, last)
    if not lies:
        rows, radii = trim_caps(rows, radii, base_at_top=upside_down)
    open_top = hint.container and not upside_down and radii[: max(3, len(radii) // 20)].mean() > 0.6 * radii.max()
    surface = revolve(silhouette, rows, radii, wall_px=WALL_SHARE * radii.max() if open_top else None)
    found = view.fit_quality(_to_picture_pixels(surface, silhouette))
    if upside_down:
        surface = surface.moved(np.diag([-1.0, -1.0, 1.0]), np.zeros(3))
    least = UPRIGHT_TIP_ANGLE_DEG if abs(tilt) < UPRIGHT_TILT_DEG else TILTED_TIP_ANGLE_DEG
    stands = hint.stands if hint.stands is not None else tip_angle_deg(surface) >= least
    if stands or (silhouette.elongation < _COMPACT and not lies):
        return CandidateSolid(surface, found, {"rests": "standing", "hollow": bool(open_top)})
    leaning = np.radians(90.0 * round((tilt + (180 if upside_down else 0)) / 90.0))  # align with an axis of the frame
    turn = np.array([[np.cos(leaning), np.sin(leaning), 0], [-np.sin(leaning), np.cos(leaning), 0], [0, 0, 1]])
    lying = lay_on_facet(surface.moved(turn, np.zeros(3)))
    return CandidateSolid(lying, found, {"rests": "lying", "hollow": bool(open_top)})


def _to_picture_pixels(surface: LiftedSurface, silhouette: Silhouette) -> LiftedSurface:
    """Return a surface about the upright axis in the pixels of the picture."""
    height, width = silhouette.mask.shape
    back = np.linalg.inv(np.vstack([upright_transform(height, width, silhouette.axis_tilt_deg), [0, 0, 1]]))
    upright = np.column_stack(
        [surface.vertices[:, 0] + silhouette.axis_column_px, -surface.vertices[:, 1], np.ones(len(surface.vertices))]
    )
    pixels = upright @ back.T
    vertices = np.column_stack([pixels[:, 0], -pixels[:, 1], surface.vertices[:, 2]])
    return LiftedSurface(vertices, surface.faces, surface.uv, surface.facing)


def box_candidate(view: MeasuredPhoto, hint: ShapeHint) -> CandidateSolid:
    """Return a box whose front is the bounding rectangle of the silhouette."""
    flat = hint.flat or hint.stands is False
    share = _flat_share(view.silhouette, hint) if flat else _deep_share(view.silhouette, hint)
    surface = make_box(view.silhouette, depth_share=share)
    # the box has the axes of the rectangle, so the rectangle's overlap is used
    found = FitQuality(view.silhouette.rectangle_iou)
    if flat:
        return CandidateSolid(lay_on_back(surface), found, {"rests": "lying", "depth_share": round(share, 4)})
    return CandidateSolid(surface, found, {"rests": "standing", "depth_share": round(share, 4)})


def _flat_share(silhouette: Silhouette, hint: ShapeHint) -> float:
    """Return the thickness of a flat box over its shorter side, from the usual volume of its category if known."""
    if not hint.flat or hint.volume_share is None:
        return _FLAT_BOX_DEPTH_SHARE
    return float(np.clip(_typical_depth_share(silhouette, hint.volume_share), _LEAST_FLAT_SHARE, DEPTH_SHARE))


def _deep_share(silhouette: Silhouette, hint: ShapeHint) -> float:
    """Return the depth of a box over its shorter side, from the usual volume of its category if that makes it deeper.

    A carton and a cube are about as deep as wide, a box of crackers is not. For 17 boxes of known dimensions (YCB's, cartons,
    packs) the error of the depth is a factor of 1.04 in the median and 1.5 at most; with ``DEPTH_SHARE`` alone 1.59 and 2.5.
    """
    if not hint.boxy or hint.volume_share is None:
        return DEPTH_SHARE
    return float(np.clip(_typical_depth_share(silhouette, hint.volume_share), DEPTH_SHARE, 1.0))


def _typical_depth_share(silhouette: Silhouette, volume_share: float) -> float:
    """Return the depth over the shorter side at which a box with the rectangle's sides has the category's usual volume."""
    sides = np.linalg.norm(np.diff(silhouette.corners[:3], axis=0), axis=1)
    return volume_share * float(sides.max() / sides.min()) ** 2


def inflation_candidate(view: MeasuredPhoto, hint: ShapeHint) -> CandidateSolid:
    """Return the inflated silhouette: rounded on both sides, with a flat base if it stands and a facet if it lies."""
    silhouette = view.silhouette
    depth = _depth(silhouette, hint)
    notes: dict[str, Any] = {"depth_limit": _share(depth.limit_px, silhouette), "depth_source": depth.source}

    def body_of(rise: float, *, flat_back: bool = False, mask: np.ndarray = silhouette.mask) -> LiftedSurface:
        limit_px, fullness = depth.limit_px, depth.fullness
        return inflate(mask, depth_limit_px=limit_px, rise=rise, flat_back=flat_back, fullness=fullness)

    sturdy = silhouette.elongation < 2.5 and not (silhouette.holes and silhouette.solidity < 0.6)
    if hint.stands or (hint.stands is None and sturdy):
        body = body_of(1.0)
        least_deg = LEAST_TIP_ANGLE_DEG if hint.stands else UPRIGHT_TIP_ANGLE_DEG
        trimmed = cut_standing_base(body, least_deg, SLIGHT_CUTS)
        cut = trimmed or cut_standing_base(body, least_deg, STANDING_CUTS)
        if cut is not None or hint.stands:
            soles = None
            if trimmed is None:  # a higher cut would remove feet
                soles = inflate_on_soles(silhouette.mask, lambda footed: body_of(1.0, mask=footed), least_deg)
            standing = soles or cut or cut_standing_base(body, LEAST_STATED_ANGLE_DEG)
            if standing is not None:
                base = "soles" if soles is not None else "cut"
                return CandidateSolid(
                    standing, view.fit_quality(standing), {"rests": "standing", "base": base, **notes}
                )
    told = depth.source != "outline"
    body = body_of(1.0 if told or silhouette.solidity > _SINGLE_BODY_SOLIDITY else _RELIEF_RISE / 2)
    found = view.fit_quality(body)
    lying = lay_on_facet(body)
    if tip_angle_deg(lying) < LEAST_TIP_ANGLE_DEG:
        relief = body_of(_KNOWN_DEPTH_RELIEF_RISE if told else _RELIEF_RISE, flat_back=True)
        return CandidateSolid(lay_on_back(relief), found, {"rests": "lying", **notes})
    return CandidateSolid(lying, found, {"rests": "lying", **notes})


@dataclass(frozen=True)
class _Depth:
    """Limit of the height on each side (None: fully round), fullness below the limit, and the source of both."""

    limit_px: float | None
    fullness: float
    source: str


def _depth(silhouette: Silhouette, hint: ShapeHint) -> _Depth:
    """Return the depth of an object that is seen from one side.

    An object whose name says round is as deep as wide. Otherwise the body gets the volume of its category: a flat object has
    uniform thickness, a round one is half again as thick in its middle. Without a category one silhouette does not tell a
    flat head from a round one; slender objects get the mean of both.
    """
    typical, largest = silhouette.typical_radius_px, silhouette.largest_radius_px
    fullness = round_fullness(silhouette.mask) if silhouette.solidity > _SINGLE_BODY_SOLIDITY else 1.0
    if hint.round and not hint.flat:
        return _Depth(None, fullness, "round")
    if hint.volume_share is not None:
        length = float(max(np.linalg.norm(np.diff(silhouette.corners[:3], axis=0), axis=1)))
        limit = depth_limit_for_volume(
            silhouette.mask, hint.volume_share * length**3, fullness=fullness, most_px=1.5 * largest
        )
        return _Depth(max(limit, 0.08 * typical), fullness, "prior")
    if hint.flat:
        return _Depth(1.15 * typical, 1.0, "outline")
    if silhouette.elongation > 2.5 or silhouette.holes:
        return _Depth(float(np.sqrt(typical * largest)), 1.0, "outline")
    return _Depth(0.6 * largest, 1.0, "outline")


def _share(limit_px: float | None, silhouette: Silhouette) -> float | None:
    return None if limit_px is None else round(limit_px / max(silhouette.mask.shape), 4)
