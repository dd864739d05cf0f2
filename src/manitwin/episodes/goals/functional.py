"""Judges of functional predicates (poured, pressed, struck, hung, inserted, handed over), from granules, contacts and holes."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from manitwin.episodes.goals.goal import Literal
from manitwin.episodes.goals.spatial import Judgement, judgement_from_conditions
from manitwin.episodes.goals.world_state import Event, Granules, Hole, ObjectState, Peg, WorldState
from manitwin.geometry.cavity import Opening
from manitwin.geometry.hull_holes import enclosed_share
from manitwin.geometry.poses import inverse, transform_points

MOST_SPILT = 0.05
PRESS_RADIUS_M, PRESS_RAD = 0.012, np.radians(30)
MOST_PRESSED = 3.0
"""Upper bound over the requested force: a higher force might break the object, and may be an artefact of the solver."""
STRIKE_RAD = np.radians(15)
CORNER_OF_SQUARE = np.sqrt(np.pi / 2)  # 1.25: half a square's diagonal over the radius of the circle of equal area
HANG_SLACK_M = 0.006
# an object leans on the rim of a bore wider than itself, tip down
INSERTED_RAD, INSERTED_SLACK_M = np.radians(45), 0.002
BELLY = 1.5  # width of a belly below the neck, in rim radii
FELL_M = 0.02  # an object released with some tilt settles by its own weight
OBLONG, CLOSED_SHARE, LEAST_SLOPE = 4.5, 0.9, 0.3  # thresholds of hole detection (geometry.frames.hole)


def is_granule_inside(vessel: ObjectState, granules: Granules) -> np.ndarray:
    """Return for each granule whether it lies in a vessel's cavity, ``(N,)`` bool."""
    if vessel.opening is None:
        return np.zeros(len(granules.positions_m), bool)
    positions_m = transform_points(inverse(vessel.object_to_world), granules.positions_m)
    return is_in_cavity(vessel.opening, np.concatenate(vessel.body.hulls), positions_m, granules.radius_m)


def is_in_cavity(
    opening: Opening, corners_m: np.ndarray, positions_m: np.ndarray, granule_radius_m: float
) -> np.ndarray:
    """Return which granules ``(..., 3)`` in a vessel's frame lie in its cavity, ``(...)`` bool.

    The cavity is the cylinder of the rim down to the deepest point, and, below the rim, the part of the convex hull of the
    vessel's ``corners_m (V, 3)`` within ``BELLY`` rim radii of the axis, which covers a belly below a neck.
    """
    from_rim_m = positions_m - opening.center_m
    along_m = from_rim_m @ opening.axis
    out_m = np.linalg.norm(from_rim_m - along_m[..., None] * opening.axis, axis=-1)
    under_rim = (along_m < granule_radius_m) & (along_m > -opening.depth_m - granule_radius_m)
    in_neck = out_m < opening.rim_radius_m + 0.3 * granule_radius_m
    wide = under_rim & ~in_neck & (along_m < 0) & (out_m < BELLY * opening.rim_radius_m)
    if not wide.any():
        return np.asarray(under_rim & in_neck)
    planes = ConvexHull(corners_m).equations
    in_belly = np.zeros_like(wide)
    in_belly[wide] = (positions_m[wide] @ planes[:, :3].T + planes[:, 3]).max(1) < 0
    return np.asarray((under_rim & in_neck) | in_belly)


def poured(state: WorldState, literal: Literal) -> Judgement:
    """Judge that the value's share of an object's granules is in another object, and at most 5 % in neither."""
    assert literal.value is not None and literal.second is not None
    source, vessel = state.object_state(literal.subject), state.object_state(literal.second)
    held = state.granules_at_start.get(literal.subject, 0)
    if state.granules is None or not held:
        return Judgement(False, "nothing_to_pour", {"granules": 0.0})
    in_vessel, in_source = is_granule_inside(vessel, state.granules), is_granule_inside(source, state.granules)
    there_before = state.granules_at_start.get(literal.second, 0)
    share = (int(in_vessel.sum()) - there_before) / held
    spilt = int((~in_vessel & ~in_source).sum()) / held
    left = int((in_source & ~in_vessel).sum()) / held
    return judgement_from_conditions(
        {"spilt": spilt <= MOST_SPILT, "left_in": share >= literal.value},
        {"share": share, "spilt": spilt, "left": left, "granules": held},
    )


def pressed(state: WorldState, literal: Literal) -> Judgement:
    """Judge that a point was pressed with one to three times the value's force, within 12 mm and 30 degrees of its normal.

    The normal points inwards. A single contact must meet all conditions at its force peak; other contacts, such as those of
    grasping fingers, do not matter. The failure reported is that of the hardest contact.
    """
    assert literal.value is not None
    found = _events(state, "pressed", literal)
    if not found:
        return Judgement(False, "not_touched", {})
    touches = [
        judgement_from_conditions(
            {
                "off": event.values["off_m"] <= PRESS_RADIUS_M,
                "askew": event.values["angle_rad"] <= PRESS_RAD,
                "weak": event.values["force_n"] >= literal.value,
                "too_hard": event.values["force_n"] <= MOST_PRESSED * literal.value,
            },
            event.values,
        )
        for event in found
    ]
    return max(touches, key=lambda touch: (touch.holds, touch.measured["force_n"]))


def struck(state: WorldState, literal: Literal) -> Judgement:
    """Judge the first contact of an object's face with another object: on the face, within 15 degrees, and fast enough.

    The value is the least speed. A level face touches with its edge first, and the corners of a square lie outside the circle
    of equal area by ``CORNER_OF_SQUARE``.
    """
    assert literal.value is not None
    found = _events(state, "struck", literal)
    if not found:
        return Judgement(False, "missed", {})
    first = found[0]
    return judgement_from_conditions(
        {
            "wrong_face": first.values["off_m"] <= CORNER_OF_SQUARE * first.values["face_radius_m"],
            "askew": first.values["angle_rad"] <= STRIKE_RAD,
            "slow": first.values["speed_m_s"] >= literal.value,
        },
        first.values,
    )


def hung(state: WorldState, literal: Literal) -> Judgement:
    """Judge that an object hangs by its hole on a peg: the peg passes through the hole, and no furniture supports the object.

    The peg passes through the hole near its centre, or at a place farther out that the object encloses (the ring of scissors
    is oblong).
    """
    assert literal.second is not None
    thing, peg = state.object_state(literal.subject), state.peg(literal.second)
    if thing.hole is None:
        return Judgement(False, "no_hole", {})
    center = transform_points(thing.object_to_world, thing.hole.center_m[None])[0] - peg.foot_m
    along_m = float(center @ peg.direction)
    off_m = float(np.linalg.norm(center - along_m * peg.direction))
    return judgement_from_conditions(
        {
            "beside_it": 0 < along_m < peg.length_m
            and (off_m <= thing.hole.radius_m + HANG_SLACK_M or _encloses(thing, thing.hole, peg)),
            "not_touching": state.touch(literal.subject, literal.second),
            "on_furniture": not state.neighbours(literal.subject) & state.furniture,
            "not_released": not state.is_handled(literal.subject),
            "moving": thing.at_rest,
        },
        {"along_m": along_m, "off_m": off_m},
    )


def inserted(state: WorldState, literal: Literal) -> Judgement:
    """Judge that an object stands in a holder tip down, its tip at least the value below the rim, supported by nothing else."""
    assert literal.second is not None and literal.value is not None
    thing, into = state.object_state(literal.subject), state.holder(literal.second)
    if thing.tip is None:
        return Judgement(False, "no_tip", {})
    to_rim = inverse(into.rim_to_world) @ thing.object_to_world
    tip_m = transform_points(to_rim, thing.tip.position_m[None])[0]
    off_m, below_m = float(np.abs(tip_m[:2]).max()), float(-tip_m[2])
    within = bool((np.abs(tip_m[:2]) <= into.half_m + INSERTED_SLACK_M).all())
    angle_rad = float(np.arccos(np.clip(-(to_rim[:3, :3] @ thing.tip.direction)[2], -1, 1)))
    touched = state.neighbours(literal.subject)
    return judgement_from_conditions(
        {
            "beside_it": within,
            "wrong_end": angle_rad <= np.pi / 2,
            "lying": angle_rad <= INSERTED_RAD,
            "not_deep": literal.value <= below_m <= into.depth_m + INSERTED_SLACK_M,
            "not_touching": bool(touched & into.bodies),
            "held_by_something_else": touched <= into.bodies | state.robots,
            "not_released": not touched & state.robots,
            "moving": thing.at_rest,
        },
        {"off_m": off_m, "below_rim_m": below_m, "angle_rad": angle_rad},
    )


def handed_over(state: WorldState, literal: Literal) -> Judgement:
    """Judge that the second arm took an object from the first, held it alone the value above its start, and put it down.

    It is put down if both arms have released it and it rests on furniture alone, at most 2 cm below where it was released.
    """
    assert literal.value is not None
    thing, touched = state.object_state(literal.subject), state.neighbours(literal.subject)
    if len(state.arms) != 2:
        return Judgement(False, "one_arm", {})
    found = _events(state, "handed_over", literal)
    if not found:
        return Judgement(False, "not_taken", {})
    values = found[-1].values
    return judgement_from_conditions(
        {
            "low": values["rise_m"] >= literal.value,
            "not_released": not touched & state.robots,
            "not_put_down": bool(touched) and touched <= state.furniture,
            "dropped": values["fell_m"] <= FELL_M,
            "moving": thing.at_rest,
        },
        values,
    )


def _encloses(thing: ObjectState, hole: Hole, peg: Peg) -> bool:
    """Tell whether the peg crosses the plane of an object's hole at a point that its hulls enclose."""
    to_object = inverse(thing.object_to_world)
    foot_m, along = transform_points(to_object, peg.foot_m[None])[0], to_object[:3, :3] @ peg.direction
    slope = float(along @ hole.axis)
    if abs(slope) < LEAST_SLOPE:
        return False
    way_m = float((hole.center_m - foot_m) @ hole.axis) / slope
    crossing = foot_m + way_m * along
    if not 0 < way_m < peg.length_m or np.linalg.norm(crossing - hole.center_m) > OBLONG * hole.radius_m:
        return False
    return enclosed_share(thing.body.hulls, crossing, hole.axis, 2 * OBLONG * hole.radius_m) >= CLOSED_SHARE


def _events(state: WorldState, kind: str, literal: Literal) -> list[Event]:
    return [
        event
        for event in state.events
        if event.kind == kind and event.subject == literal.subject and event.second == literal.second
    ]
