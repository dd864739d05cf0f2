"""How a parallel hand closes, the same in every engine: one target of both fingers, which never presses too hard."""

from __future__ import annotations

from manitwin.physics.trial import TrialSettings

STILL_SHARE = 0.01  # of the closing speed: slower fingers have been stopped, and do not just lag behind their target
MET_M = 1e-6  # pads this close have met


class SharedTarget:
    """The one position target of both fingers of a closing parallel hand; it never presses with more than the closing force.

    The mechanical coupling of the real hand does the same; two independently saturated fingers have no lateral stiffness
    and drift by centimetres.

    Coordinates are the distances (m) of the pads from the plane between them. Pads that meet (``met_m`` and less) have
    nothing between them, whatever they overlap: the target goes back to where it was, as a gripper opens again that
    reports an empty hand. Without this, fingers that have tunnelled into a thin and light object hold it. ``presses`` tells
    whether the fingers have come to a stop, as far behind the target as the closing force pushes.
    """

    def __init__(self, opening_m: float, settings: TrialSettings, met_m: float = MET_M):
        self.value_m = self._open_m = opening_m / 2
        self._met_m, self._met, self.presses = met_m, False, False
        self._before_m: float | None = None
        self._press_m = settings.force_n / settings.finger_stiffness_n_m
        self._ramp_m = settings.close_speed_m_s * settings.frame_s

    def move_on(self, mean_position_m: float) -> float:
        """Move on by one frame and return the target; ``mean_position_m`` is that of the two fingers."""
        self._met = self._met or mean_position_m <= self._met_m
        if self._met:
            self.value_m, self.presses = self._open_m, False
            return self.value_m
        goal_m = self.value_m - self._ramp_m
        self.value_m = max(goal_m, mean_position_m - self._press_m)
        stopped = self._before_m is not None and abs(mean_position_m - self._before_m) < STILL_SHARE * self._ramp_m
        self._before_m, self.presses = mean_position_m, stopped and self.value_m > goal_m
        return self.value_m
