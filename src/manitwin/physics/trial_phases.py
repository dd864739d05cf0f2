"""Phases of a grasp trial, the same in every engine: close, lift, stable frames, slides along six directions.

Source: paper, "Simulation Verification" (stable frames, slides, 1 cm, 2,000 steps).

The scene's frame is the hand's and translates with it. The hand therefore stays at rest in the scene, and the object is
loaded by its weight and the inertial force of the path, -m a.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from manitwin.geometry.poses import rotation_angle_rad
from manitwin.physics.trial import GRAVITY_M_S2, TrialResult, TrialSettings
from manitwin.twin.grasp_summary import Outcome

CHECK_EVERY_FRAMES = 4
SLIDE_DIRECTIONS = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]], float)
# A stroke accelerates and decelerates, so one along +X loads the object along -X and +X: three strokes out along X, Y
# and Z load all six directions once, three out and back twice, and all twelve four times. Of 1,735 grasps (25 objects)
# in which the object had moved less than a fifth of the limit after six strokes, one failed in the other six, so the
# other six are skipped for such grasps. After three strokes the threshold is half as large, which is the same rate of
# creep.
LOADED_ONCE, LOADED_TWICE, SURE_SHARE = (0, 2, 4), 6, 0.2
# Brief trial. An object at rest under the peak load of the lift, before the hand decelerates, has carried the largest load of
# the lift: the hand then continues at constant speed. Shorter strokes with the same accelerations load the object once along
# each direction. It is held if it moves by less than STEADY_SHARE of the limit, since an object that friction cannot carry
# slips by the square of the stroke's time; otherwise whole strokes follow. A loss in a brief trial is no verdict: the whole
# trial is run. Objects that have turned far are not tried briefly.
PEAK_SHARE, EVEN_SHARE, REST_M, REST_RAD = 0.25, 0.5, 0.0002, 0.02  # REST_M and REST_RAD are limits between two checks
BRIEF_STROKE_S = 0.0875  # 21 steps of 1/240 s sample the peak acceleration exactly, 24 steps miss it by 0.6 %
STEADY_SHARE, TURNED_RAD = 0.02, 0.15
CLOSED_SPEED_M_S, CLOSED_SPEED_RAD_S = 0.001, 0.01
"""An object that moves more slowly than this in a hand that presses with the full closing force is at rest."""
Phase = Literal["open", "close", "lift", "hold", "slide"]
TrialWatch = Callable[[Phase, float, np.ndarray], None]
"""Callback after each advance: phase, time (s), and displacement ``(3,)`` m of the hand along the object's axes."""


@dataclass(frozen=True)
class HandContacts:
    """Inward force (N) of each finger on the object, and deepest overlap (m) of hand and object."""

    forces_n: tuple[float, ...]
    penetration_m: float


class TrialScene(Protocol):
    """One open hand and one object in an engine; poses and loads are in the scene's frame, which is the hand's."""

    def advance(self, loads_m_s2: np.ndarray) -> None:
        """Take one step for each row ``(N, 3)`` m/s^2: the object's acceleration by weight and inertial force."""
        ...

    def squeeze(self) -> None:
        """Advance the fingers' common target by one frame, until they press with the closing force."""
        ...

    def presses(self) -> bool:
        """Tell whether the fingers press with the closing force, as far as the hand can measure it."""
        ...

    def contacts(self) -> HandContacts:
        """Return the contact forces of the fingers and the deepest overlap."""
        ...

    def object_rotation(self) -> np.ndarray:
        """Return the object's rotation ``(3, 3)``."""
        ...

    def center_of_mass_m(self) -> np.ndarray:
        """Return the object's centre of mass ``(3,)`` m."""
        ...


class _Failed(Exception):
    """The grasp failed; ends the trial with this outcome."""

    def __init__(self, outcome: Outcome):
        super().__init__(outcome)
        self.outcome: Outcome = outcome


def run_phases(
    scene: TrialScene, object_to_hand: np.ndarray, settings: TrialSettings, watch: TrialWatch | None = None
) -> TrialResult:
    """Run the phases until one fails; ``object_to_hand (3, 3)`` rotates the object's axes, along which the hand moves."""
    return _Phases(scene, object_to_hand, settings, watch).run()


def run_brief_phases(
    scene: TrialScene, object_to_hand: np.ndarray, settings: TrialSettings, watch: TrialWatch | None = None
) -> TrialResult | None:
    """Run ``run_phases`` shortened for an object that comes to rest; return None if that is inconclusive.

    After None the trial has to be run again with ``run_phases``, in a new scene.
    """
    phases = _Phases(scene, object_to_hand, settings, watch, may_be_brief=True)
    result = phases.run()
    return None if phases.was_brief and result.outcome != "held" else result


class _Phases:
    def __init__(
        self,
        scene: TrialScene,
        object_to_hand: np.ndarray,
        settings: TrialSettings,
        watch: TrialWatch | None,
        may_be_brief: bool = False,
    ):
        self.may_be_brief, self.was_brief = may_be_brief, False
        self.scene, self.object_to_hand, self.settings, self.watch = scene, object_to_hand, settings, watch
        self.phase: Phase = "open"
        self.hand_m, self.coasting_m_s = np.zeros(3), np.zeros(3)
        self.steps = 0
        self.displacement_m = self.rotation_rad = self.penetration_m = 0.0
        self.forces_n: tuple[float, ...] = ()
        self.closed_rotation: np.ndarray | None = None
        self.pressed: list[tuple[np.ndarray, np.ndarray]] = []

    def run(self) -> TrialResult:
        outcome: Outcome = "held"
        try:
            self._start_free()
            self._close()
            self._lift()
            self._wait_for_stable_frames()
            self._slide()
        except _Failed as failure:
            outcome = failure.outcome
        self.rotation_rad = self._turned_rad()
        return TrialResult(
            outcome, self.displacement_m, self.rotation_rad, self.penetration_m, self.forces_n, self.steps
        )

    def _start_free(self) -> None:
        self._advance(np.zeros((1, 3)))
        if self.scene.contacts().penetration_m > self.settings.max_overlap_m:
            raise _Failed("collides")

    def _close(self) -> None:
        settings, self.phase = self.settings, "close"
        weightless = np.zeros((settings.steps_per_frame, 3))
        for _ in range(round(settings.close_time_s / settings.frame_s)):
            self.scene.squeeze()
            self._advance(weightless)
            if self._rests_in_closed_hand():
                break
        self._check_hold("misses")
        self.closed_rotation = self.scene.object_rotation()

    def _rests_in_closed_hand(self) -> bool:
        """Tell whether the hand has pressed for ``stable_frames`` without motion of the object, so that closing can end early."""
        if not self.scene.presses():
            self.pressed = []
            return False
        self.pressed.append((self.scene.center_of_mass_m(), self.scene.object_rotation()))
        if len(self.pressed) <= self.settings.stable_frames:
            return False
        (place, rotation), (now, turned) = self.pressed[-1 - self.settings.stable_frames], self.pressed[-1]
        time_s = self.settings.stable_frames * self.settings.frame_s
        return (
            float(np.linalg.norm(now - place)) < CLOSED_SPEED_M_S * time_s
            and rotation_angle_rad(turned @ rotation.T) < CLOSED_SPEED_RAD_S * time_s
        )

    def _lift(self) -> None:
        settings, self.phase = self.settings, "lift"
        reference = self.scene.center_of_mass_m()
        path = np.array([0, 0, settings.lift_m])
        limit_m = settings.max_lift_displacement_m
        self._move(path, settings.lift_time_s, reference, limit_m, "drops", may_coast=self.may_be_brief)

    def _wait_for_stable_frames(self) -> None:
        settings, self.phase = self.settings, "hold"
        stable, before = 0, self.scene.center_of_mass_m()
        at_rest = self._loads(np.zeros((settings.steps_per_frame, 3)))
        for _ in range(round(settings.stable_time_s / settings.frame_s)):
            self.hand_m = self.hand_m + self.settings.frame_s * self.coasting_m_s
            self._advance(at_rest)
            now = self.scene.center_of_mass_m()
            moved = float(np.linalg.norm(now - before))
            stable, before = (stable + 1 if moved < settings.stable_speed_m_s * settings.frame_s else 0), now
            if stable >= settings.stable_frames:
                self._check_hold("drops")
                return
        raise _Failed("unstable")

    def _slide(self) -> None:
        settings, self.phase = self.settings, "slide"
        reference = self.scene.center_of_mass_m()
        self.displacement_m = 0.0
        strokes = [sign * settings.slide_m * direction for direction in SLIDE_DIRECTIONS for sign in (1, -1)]
        if self.may_be_brief and self._turned_rad() < TURNED_RAD and self._stays_in_brief_strokes(strokes, reference):
            return
        sure_m, order = SURE_SHARE * settings.max_displacement_m, list(range(len(strokes)))
        for number in LOADED_ONCE:
            order.remove(number)
            self._move(strokes[number], settings.slide_time_s, reference, settings.max_displacement_m, "slips")
            if self.displacement_m >= sure_m / 2:
                break
        else:
            order = []
        for number in order:
            if number >= LOADED_TWICE and self.displacement_m < sure_m:
                break
            self._move(strokes[number], settings.slide_time_s, reference, settings.max_displacement_m, "slips")
        self._check_hold("slips")

    def _stays_in_brief_strokes(self, strokes: list[np.ndarray], reference: np.ndarray) -> bool:
        """Load the object once along each direction by brief strokes, and tell whether it stays in place."""
        settings, self.was_brief = self.settings, True
        shorter = min(1.0, BRIEF_STROKE_S / settings.slide_time_s)
        path, time_s, limit_m = shorter**2, shorter * settings.slide_time_s, settings.max_displacement_m
        for number in LOADED_ONCE:
            self._move(path * strokes[number], time_s, reference, limit_m, "slips")
            if self.displacement_m >= STEADY_SHARE * limit_m:
                return False
        self._check_hold("slips")
        return True

    def _move(
        self,
        path_m: np.ndarray,
        time_s: float,
        reference: np.ndarray,
        limit_m: float,
        outcome: Outcome,
        *,
        may_coast: bool = False,
    ) -> None:
        """Move the hand along a path ``(3,)`` m in the object's axes with a quintic profile; fail if the object lags behind.

        If ``may_coast`` and the object is at rest after the peak acceleration, the hand keeps its speed from there on.
        """
        count = round(time_s / self.settings.timestep_s)
        u = (np.arange(count) + 0.5) / count
        profile = (60 * u - 180 * u**2 + 120 * u**3) / time_s**2
        start_m, done, before = self.hand_m, 0, self._look() if may_coast else None
        for loads in _chunks(
            self._loads(profile[:, None] * path_m), CHECK_EVERY_FRAMES * self.settings.steps_per_frame
        ):
            done += len(loads)
            start_m = start_m + len(loads) * self.settings.timestep_s * self.coasting_m_s
            self.hand_m = start_m + _share_of_path(done / count) * path_m
            self._advance(loads)
            moved = float(np.linalg.norm(self.scene.center_of_mass_m() - reference))
            self.displacement_m = max(self.displacement_m, moved)
            if not moved <= limit_m:
                raise _Failed(outcome)
            if before is not None and done <= EVEN_SHARE * count:
                at_rest, before = self._rests_since(before), self._look()
                if at_rest and done >= PEAK_SHARE * count:
                    self.coasting_m_s, self.was_brief = _speed_on_path(done / count) / time_s * path_m, True
                    return

    def _look(self) -> tuple[np.ndarray, np.ndarray]:
        return self.scene.center_of_mass_m(), self.scene.object_rotation()

    def _rests_since(self, before: tuple[np.ndarray, np.ndarray]) -> bool:
        """Tell whether the object has moved less than ``REST_M`` and ``REST_RAD`` since a look."""
        (place, rotation), (now, turned) = before, self._look()
        return float(np.linalg.norm(now - place)) < REST_M and rotation_angle_rad(turned @ rotation.T) < REST_RAD

    def _turned_rad(self) -> float:
        """Return the object's rotation (rad) in the hand since it closed."""
        if self.closed_rotation is None:
            return 0.0
        return rotation_angle_rad(self.scene.object_rotation() @ self.closed_rotation.T)

    def _loads(self, acceleration_m_s2: np.ndarray) -> np.ndarray:
        """Return the object's loads ``(N, 3)`` m/s^2 in the hand's frame, given the hand's accelerations in the object's axes."""
        return ([0, 0, -GRAVITY_M_S2] - acceleration_m_s2) @ self.object_to_hand.T

    def _check_hold(self, outcome: Outcome) -> None:
        """Fail unless every finger presses inwards and none penetrates the object too deeply."""
        contacts = self.scene.contacts()
        self.penetration_m = max(self.penetration_m, contacts.penetration_m)
        if self.closed_rotation is None:
            self.forces_n = contacts.forces_n
        if not min(contacts.forces_n) > self.settings.min_finger_force_n:
            raise _Failed(outcome)
        if contacts.penetration_m > self.settings.max_penetration_m:
            raise _Failed("penetrates")

    def _advance(self, loads_m_s2: np.ndarray) -> None:
        left = self.settings.max_steps - self.steps
        self.scene.advance(loads_m_s2 if left >= len(loads_m_s2) else loads_m_s2[:left])
        self.steps += min(left, len(loads_m_s2))
        if self.watch is not None:
            self.watch(self.phase, self.steps * self.settings.timestep_s, self.hand_m)
        if left < len(loads_m_s2):
            raise _Failed("unstable")


def _share_of_path(u: float) -> float:
    """Return the share of a quintic path covered at the share ``u`` of its duration."""
    return 10 * u**3 - 15 * u**4 + 6 * u**5


def _speed_on_path(u: float) -> float:
    """Return the derivative of the quintic path at the share ``u`` of its duration."""
    return 30 * u**2 * (1 - u) ** 2


def _chunks(rows: np.ndarray, size: int) -> Iterator[np.ndarray]:
    return (rows[start : start + size] for start in range(0, len(rows), size))
