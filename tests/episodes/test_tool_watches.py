"""Watches of tools: what they measure on motions of known shape, and what is judged of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from brick_episodes import panda, problem

from manitwin.episodes.episode import create_world
from manitwin.episodes.goals.evaluation import judge
from manitwin.episodes.goals.goal import Literal
from manitwin.episodes.goals.world_state import ObjectState, WorldState
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.tool_watches import AimWatch, CutWatch, PushWatch, StirWatch, WipeWatch
from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import transform
from manitwin.physics.sapien.contacts import ContactReader, ResultantForce
from rigid_boxes import box

STEP_S = 1 / 120
CUP = Opening(np.array([0.0, 0, 1]), np.array([0, 0, 0.1]), 0.04, 5e-4, 0.1)
READER: ContactReader = None  # type: ignore[assignment]  # of watches that ask for no contacts


def failure(predicate: str, watch: object, second: str, value: float | None = None) -> str | None:
    events = watch.events  # type: ignore[attr-defined]
    state = WorldState({}, frozenset(), events=events, granules_at_start={"cup": 60})
    return judge(state, Literal(predicate, "tool", second, value)).failure


def stir(radius_m: float, turns: float, height_m: float = 0.03, moved_m: float = 0.05) -> StirWatch:
    at, granules = np.zeros(3), np.zeros((60, 3))
    watch = StirWatch("tool", "cup", lambda: at, lambda: np.eye(4), CUP, granules.copy, 0.005)
    for angle in np.linspace(0, 2 * np.pi * turns, 100):
        at[:] = radius_m * np.cos(angle), radius_m * np.sin(angle), height_m
        watch.look(READER, (), 0.0)
    granules[:, 0] += moved_m
    return watch


def test_stirring_goes_all_around_inside_and_moves_what_is_there() -> None:
    assert failure("stirred", stir(0.02, 1.0), "cup") is None
    assert stir(0.02, 1.0).events[0].values == {"sectors": 1.0, "moved": 1.0}
    assert failure("stirred", stir(0.02, 0.5), "cup") == "not_all_around"
    assert failure("stirred", stir(0.02, 1.0, height_m=0.09), "cup") == "missed"
    assert failure("stirred", stir(0.15, 1.0), "cup") == "missed"
    assert failure("stirred", stir(0.02, 1.0, moved_m=0.002), "cup") == "content_still"
    empty = WorldState({}, frozenset(), events=stir(0.02, 1.0).events)
    assert judge(empty, Literal("stirred", "tool", "cup")).failure == "nothing_to_stir"


@pytest.mark.parametrize(
    ("mass_kg", "way_m", "down", "expected"),
    [
        (0.3, 0.08, -1, None),
        (0.03, 0.08, -1, "force_off"),
        (0.3, 0.02, -1, "not_all_swept"),
        (0.3, 0.08, 1, "wrong_face"),
    ],
)
def test_a_brick_that_slides_wipes_by_its_weight_where_it_comes(
    mass_kg: float, way_m: float, down: int, expected: str | None
) -> None:
    start = transform(None, np.array([0.45, 0, 0.02]))
    asked = replace(problem(start), target=replace(problem().target, name="tool", object_to_world=start))
    asked = replace(asked, target=replace(asked.target, body=box([0.04, 0.06, 0.04], mass_kg, 0.3)))
    face = transform(np.diag([1.0, down, down]))[None]
    patch, half_m = transform(None, np.array([0.49, 0, 0.0])), np.array([0.05, 0.025])
    with create_world(asked, panda()[0], EpisodeSettings(), 50.0) as world:
        points = np.concatenate(world.placed[0].body.hulls)
        watch = WipeWatch("tool", "table", "patch", patch, half_m, points, lambda: world.object_to_world(0), face)
        for _ in range(48):
            world.bodies[0].set_linear_velocity(np.array([way_m / (48 * STEP_S), 0, 0], np.float32))
            world.step()
            watch.look(world.contacts, world.contacts.read(), 0.0)
    assert watch.events[0].values["force_n"] == pytest.approx(9.81 * mass_kg, rel=0.1)
    assert failure("wiped", watch, "patch") == expected


def test_a_push_is_touched_by_whom_it_is_asked_of_and_tells_how_high_it_rose() -> None:
    with create_world(problem(), panda()[0], EpisodeSettings(), 50.0) as world:

        def center() -> np.ndarray:
            return world.object_to_world(0)[:3, 3]

        watches = [PushWatch("object_01", frozenset({by}), center) for by in ("table", "panda_hand")]
        for step in range(24):
            if step == 12:
                world.bodies[0].set_linear_velocity(np.array([0, 0, 0.5], np.float32))
            world.step()
            for each in watches:
                each.look(world.contacts, world.contacts.read(), 0.0)
    assert watches[1].events == ()
    assert watches[0].events[0].values["rise_m"] == pytest.approx(0.5**2 / 2 / 9.81 - 0.5 * STEP_S / 2, rel=0.02)


@dataclass
class Touches:
    """A reader of contacts that tells of a touch as long as it is asked to."""

    touched: bool = False

    def resultant_force(self, contacts: object, subject: str, by: frozenset[str]) -> ResultantForce | None:
        return ResultantForce(np.array([1.0, 0, 0]), np.zeros(3)) if self.touched else None


def looked_at(watch: PushWatch, at: np.ndarray, way: list[tuple[float, float, bool, float]]) -> None:
    """Show the watch a way of x, z (m), whether it is touched, and for how long (s); ``at (3,)`` is where its middle is."""
    reader, time_s = Touches(), 0.0
    for x_m, z_m, touched, lasts_s in way:
        at[:] = (x_m, 0, z_m)
        reader.touched = touched
        for _ in range(round(lasts_s / STEP_S) + 1):
            watch.look(reader, [], time_s)  # type: ignore[arg-type]
            time_s += STEP_S


PUT_ELSEWHERE = [(0.0, 0.02, False, 0.1), (0.0, 0.02, True, 0.1), (0.2, 0.1, True, 0.2), (0.3, 0.02, True, 0.1)]


@pytest.mark.parametrize(
    ("then", "expected"),
    [
        ([(0.4, 0.02, True, 0.1)], "lifted"),  # never let go
        ([(0.3, 0.02, False, 0.1), (0.4, 0.02, True, 0.1)], "lifted"),  # for a moment
        ([(0.3, 0.02, False, 0.4)], "not_touched"),
        ([(0.3, 0.02, False, 0.4), (0.31, 0.02, True, 0.1)], "hardly_moved"),
        ([(0.3, 0.02, False, 0.4), (0.4, 0.02, True, 0.1)], None),
        ([(0.3, 0.02, False, 0.4), (0.35, 0.06, True, 0.1), (0.4, 0.02, True, 0.1)], "lifted"),
    ],
)
def test_what_was_put_somewhere_is_pushed_from_there(
    then: list[tuple[float, float, bool, float]], expected: str | None
) -> None:
    at = np.zeros(3)
    watch = PushWatch("item", frozenset({"hand"}), at.copy)
    looked_at(watch, at, PUT_ELSEWHERE + then)
    item = ObjectState(box([0.04, 0.04, 0.04], 0.1), transform(None, at), np.eye(4), True)
    state = WorldState({"item": item}, frozenset(), events=watch.events, places_m={"mark": at})
    assert judge(state, Literal("pushed_to", "item", "mark", 0.02)).failure == expected


@pytest.mark.parametrize(
    ("off_m", "yaw_deg", "roll_deg", "expected"),
    [(0.003, 5, 5, None), (0.007, 0, 0, "not_along"), (0.0, 12, 0, "not_along"), (0.0, 0, 12, "not_along")],
)
def test_a_cut_keeps_to_its_line(off_m: float, yaw_deg: float, roll_deg: float, expected: str | None) -> None:
    yaw, roll = np.radians([yaw_deg, roll_deg])
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    tilt = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    edge = transform(turn @ tilt @ np.diag([1.0, -1, -1]), np.zeros(3))
    watch = CutWatch("tool", "line", np.eye(4), 0.06, lambda: edge, 0.03)
    for along_m in np.linspace(-0.03, 0.03, 60):
        edge[:3, 3] = along_m * np.array([1, 0, 0]) + [0, off_m, 0]
        watch.look(READER, (), 0.0)
    assert failure("cut_motion", watch, "line") == expected


def test_a_long_edge_that_is_only_set_down_has_not_been_drawn() -> None:
    edge = transform(np.diag([1.0, -1, -1]), np.zeros(3))
    watch = CutWatch("tool", "line", np.eye(4), 0.06, lambda: edge, 0.2)
    for high_m in np.linspace(0.03, 0, 10):
        edge[2, 3] = high_m
        watch.look(READER, (), 0.0)
    assert watch.events[0].values["share"] == 1
    assert failure("cut_motion", watch, "line") == "not_drawn"


def test_aiming_is_near_straight_and_lasts() -> None:
    def aim(turn_rad: float, distance_m: float, looks: int) -> str | None:
        cos, sin = np.cos(turn_rad), np.sin(turn_rad)
        nozzle = transform(np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]), np.zeros(3))
        watch = AimWatch("tool", "cup", lambda: nozzle, lambda: np.array([0, 0, distance_m]), STEP_S)
        for _ in range(looks):
            watch.look(READER, (), 0.0)
        return failure("aimed", watch, "cup")

    assert aim(0.1, 0.15, 40) is None
    assert aim(0.2, 0.15, 40) == "askew"
    assert aim(0.1, 0.5, 40) == "too_far"
    assert aim(0.1, 0.01, 40) == "too_near"
    assert aim(0.1, 0.15, 10) == "too_short"


def test_the_best_aim_is_told_to_less_than_a_milliradian() -> None:
    ways = iter([np.array([0.0, 6e-5, 0.2]), np.array([0.0, 1e-5, 0.1]), np.array([0.0, 6e-5, 0.2])])
    nozzle = transform(np.eye(3) * (1 + 1e-7))  # as single precision has axes
    watch = AimWatch("tool", "cup", lambda: nozzle, lambda: next(ways), STEP_S)
    for _ in range(3):
        watch.look(READER, (), 0.0)
    assert watch.events[0].values["angle_rad"] == pytest.approx(1e-4, rel=1e-3)
    assert watch.events[0].values["distance_m"] == pytest.approx(0.1, rel=1e-3)
