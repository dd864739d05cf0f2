"""Judges of spatial predicates: beside, on, in, near, away from, upright, lifted, touching, pushed, undisturbed.

Sides are seen by the robot: it stands at the origin of the world and looks along +X, so that left is +Y and behind is +X.
Every judge returns its measurements, whether the literal holds or not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from manitwin.episodes.goals.goal import Literal
from manitwin.episodes.goals.world_state import ObjectState, WorldState
from manitwin.geometry.boxes import separation_m
from manitwin.geometry.poses import rotation_angle_rad, transform_points

SIDES: Mapping[str, np.ndarray] = {
    "left_of": np.array([0.0, 1.0]),
    "right_of": np.array([0.0, -1.0]),
    "behind": np.array([1.0, 0.0]),
    "in_front_of": np.array([-1.0, 0.0]),
}
SECTOR_RAD = np.pi / 4
SIDE_GAP_M = (0.0, 0.14)
UPRIGHT_RAD = np.radians(10)
OPENS_UPWARD = np.cos(np.radians(12))
LEAST_INSIDE_M = 0.02
MOST_RISE_M, LEAST_PUSH_M = 0.01, 0.03
DISTURBED_M, DISTURBED_RAD = 0.01, np.radians(5)


@dataclass(frozen=True)
class Judgement:
    """Whether a literal holds, the first condition that fails if not, and the measured values (SI)."""

    holds: bool
    failure: str | None
    measured: Mapping[str, float]


def judgement_from_conditions(conditions: Mapping[str, bool], measured: Mapping[str, float]) -> Judgement:
    """Return a judgement from ordered conditions: the first that is not met names the failure."""
    failure = next((name for name, met in conditions.items() if not met), None)
    return Judgement(failure is None, failure, {name: float(value) for name, value in measured.items()})


def beside(state: WorldState, literal: Literal) -> Judgement:
    """Judge a side: centre of mass within 45 degrees of the side's direction, footprints disjoint and at most 14 cm apart."""
    moved, other = _both(state, literal)
    offset = moved.center_of_mass_m[:2] - other.center_of_mass_m[:2]
    distance_m = float(np.linalg.norm(offset))
    cosine = float(offset @ SIDES[literal.predicate]) / max(distance_m, 1e-9)
    gap_m = separation_m(moved.footprint_m, other.footprint_m)
    angle_rad = float(np.arccos(np.clip(cosine, -1, 1)))
    return judgement_from_conditions(
        {
            "another_side": angle_rad <= SECTOR_RAD,
            "above_it": gap_m > SIDE_GAP_M[0],
            "too_far": gap_m <= SIDE_GAP_M[1],
            **_set_down(state, literal.subject),
        },
        {"angle_rad": angle_rad, "gap_m": gap_m},
    )


def near(state: WorldState, literal: Literal) -> Judgement:
    """Judge that the distance of the footprints is at most the value."""
    assert literal.value is not None
    moved, other = _both(state, literal)
    gap_m = separation_m(moved.footprint_m, other.footprint_m)
    return judgement_from_conditions(
        {"too_far": gap_m <= literal.value, **_set_down(state, literal.subject)}, {"gap_m": gap_m}
    )


def away_from(state: WorldState, literal: Literal) -> Judgement:
    """Judge that the distance of the footprints is at least the value, and that the object is released and at rest."""
    assert literal.value is not None
    moved, other = _both(state, literal)
    gap_m = separation_m(moved.footprint_m, other.footprint_m)
    return judgement_from_conditions(
        {"too_near": gap_m >= literal.value, **_set_down(state, literal.subject)}, {"gap_m": gap_m}
    )


def on(state: WorldState, literal: Literal) -> Judgement:
    """Judge that another object alone supports an object, with its centre of mass above the other's footprint."""
    moved, other = _both(state, literal)
    base = other.footprint_m
    outside_m = separation_m(base, moved.center_of_mass_m[None, :2] + _DOT_M)
    strange = state.neighbours(literal.subject) - {literal.second} - state.robots
    return judgement_from_conditions(
        {
            "not_touching": state.touch(literal.subject, str(literal.second)),
            "held_by_something_else": not strange,
            "beside_it": outside_m <= 0,
            "below_it": moved.points_m[:, 2].min() > other.points_m[:, 2].min()
            and moved.center_of_mass_m[2] > other.center_of_mass_m[2],
            **_set_down(state, literal.subject),
        },
        {"outside_m": outside_m, "height_m": moved.center_of_mass_m[2] - other.center_of_mass_m[2]},
    )


def inside(state: WorldState, literal: Literal) -> Judgement:
    """Judge that an object lies in another: centre of mass within the opening, lowest point below the rim.

    The lowest point must be a quarter of the depth below the rim, at most 2 cm. The object touches the vessel (or its
    contents) and no furniture.
    """
    moved, vessel = _both(state, literal)
    opening = vessel.opening
    if opening is None:
        return Judgement(False, "no_opening", {})
    up = float((vessel.object_to_world[:3, :3] @ opening.axis)[2])
    center = transform_points(vessel.object_to_world, opening.center_m[None])[0]
    off_axis_m = float(np.linalg.norm(moved.center_of_mass_m[:2] - center[:2]))
    below_m = float(center[2] - moved.points_m[:, 2].min())
    touched = state.neighbours(literal.subject) - state.robots
    return judgement_from_conditions(
        {
            "turned_over": up >= OPENS_UPWARD,
            "beside_it": off_axis_m <= opening.rim_radius_m,
            "on_the_rim": below_m >= min(LEAST_INSIDE_M, opening.depth_m / 4),
            "not_touching": bool(touched & set(state.objects)),
            "on_furniture": not touched & state.furniture,
            **_set_down(state, literal.subject),
        },
        {"off_axis_m": off_axis_m, "below_rim_m": below_m},
    )


def upright(state: WorldState, literal: Literal) -> Judgement:
    """Judge that an object's up axis (+Z of its frame) is within 10 degrees of the vertical."""
    turned_rad = float(np.arccos(np.clip(state.object_state(literal.subject).object_to_world[2, 2], -1, 1)))
    return judgement_from_conditions(
        {"tilted": turned_rad <= UPRIGHT_RAD, **_set_down(state, literal.subject)}, {"tilt_rad": turned_rad}
    )


def lifted(state: WorldState, literal: Literal) -> Judgement:
    """Judge that an object is in the hand, with its centre of mass at least the value above its start."""
    assert literal.value is not None
    moved = state.object_state(literal.subject)
    start_m = transform_points(moved.start_object_to_world, moved.body.center_of_mass_m[None])[0, 2]
    rise_m = float(moved.center_of_mass_m[2] - start_m)
    return judgement_from_conditions(
        {"not_held": state.is_handled(literal.subject), "too_low": rise_m >= literal.value}, {"rise_m": rise_m}
    )


def touching(state: WorldState, literal: Literal) -> Judgement:
    """Judge that two objects press on each other."""
    _both(state, literal)
    return judgement_from_conditions({"not_touching": state.touch(literal.subject, str(literal.second))}, {})


def undisturbed(state: WorldState, literal: Literal) -> Judgement:
    """Judge that an object has moved by at most 1 cm and turned by at most 5 degrees since the start."""
    thing = state.object_state(literal.subject)
    start = transform_points(thing.start_object_to_world, thing.body.center_of_mass_m[None])[0]
    moved_m = float(np.linalg.norm(thing.center_of_mass_m - start))
    turned_rad = rotation_angle_rad(thing.object_to_world[:3, :3] @ thing.start_object_to_world[:3, :3].T)
    return judgement_from_conditions(
        {"moved": moved_m <= DISTURBED_M, "turned": turned_rad <= DISTURBED_RAD},
        {"moved_m": moved_m, "turned_rad": turned_rad},
    )


def pushed_to(state: WorldState, literal: Literal) -> Judgement:
    """Judge that an object was pushed to a place: centre of mass within the value of it, and at rest.

    An object counts as pushed if the robot's hand touched it (an event) and it then moved at least 3 cm without rising by
    more than 1 cm.
    """
    assert literal.value is not None and literal.second is not None
    thing = state.object_state(literal.subject)
    off_m = float(np.linalg.norm(thing.center_of_mass_m[:2] - state.place(literal.second)[:2]))
    pushes = [each.values for each in state.events if (each.kind, each.subject) == ("pushed", literal.subject)]
    rise_m, way_m = (max((values[name] for values in pushes), default=0.0) for name in ("rise_m", "way_m"))
    return judgement_from_conditions(
        {
            "beside_it": off_m <= literal.value,
            "not_touched": bool(pushes),
            "lifted": rise_m <= MOST_RISE_M,
            "hardly_moved": way_m >= LEAST_PUSH_M,
            "not_released": not state.is_handled(literal.subject),
            "moving": thing.at_rest,
        },
        {"off_m": off_m, "rise_m": rise_m, "way_m": way_m},
    )


_DOT_M = 1e-4 * np.array([[1.0, 0], [-0.5, 0.8], [-0.5, -0.8]])  # a point as a very small polygon


def _both(state: WorldState, literal: Literal) -> tuple[ObjectState, ObjectState]:
    assert literal.second is not None
    return state.object_state(literal.subject), state.object_state(literal.second)


def _set_down(state: WorldState, name: str) -> dict[str, bool]:
    """Return the conditions of a placed object: released and at rest."""
    return {"not_released": not state.is_handled(name), "moving": state.object_state(name).at_rest}
