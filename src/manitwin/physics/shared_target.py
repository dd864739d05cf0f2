"""Closing control of a parallel hand, the same in every engine: one position target for both fingers, with limited force."""

from __future__ import annotations

from manitwin.physics.trial import TrialSettings

# of the closing speed: slower fingers are stopped by the object, not merely lagging behind their target
STILL_SHARE = 0.01
MET_M = 1e-6  # pads closer than this are considered to have met


class SharedTarget:
    """Position target shared by both fingers of a closing parallel hand, limited to press with at most the closing force.

    The mechanical coupling of a real hand has the same effect. Two independently saturated fingers would have no lateral
    stiffness and drift by centimetres.

    Coordinates are the distances (m) of the pads from the plane between them. If the pads meet (mean position at most
    ``met_m``), there is nothing between them: the target returns to the open position, as a gripper opens again that reports
    an empty hand. Without this rule, fingers that have tunnelled into a thin, light object would hold it. ``presses`` tells
    whether the fingers have stopped and lag behind the target by the distance that yields the closing force.
    """

    def __init__(self, opening_m: float, settings: TrialSettings, met_m: float = MET_M):
        self.value_m = self._open_m = opening_m / 2
        self._met_m, self._met, self.presses = met_m, False, False
        self._before_m: float | None = None
        self._press_m = settings.force_n / settings.finger_stiffness_n_m
        self._ramp_m = settings.close_speed_m_s * settings.frame_s

    def advance_target(self, mean_position_m: float) -> float:
        """Advance the target by one frame and return it (m); ``mean_position_m`` is the mean position of the two fingers."""
        self._met = self._met or mean_position_m <= self._met_m
        if self._met:
            self.value_m, self.presses = self._open_m, False
            return self.value_m
        goal_m = self.value_m - self._ramp_m
        self.value_m = max(goal_m, mean_position_m - self._press_m)
        stopped = self._before_m is not None and abs(mean_position_m - self._before_m) < STILL_SHARE * self._ramp_m
        self._before_m, self.presses = mean_position_m, stopped and self.value_m > goal_m
        return self.value_m
