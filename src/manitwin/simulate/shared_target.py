"""The closing of a parallel hand: one position target for both fingers.

It is what the mechanical coupling of the real hand does; two independently saturated fingers have no lateral stiffness
and drift by centimetres.
"""

from __future__ import annotations

from manitwin.simulate.trial import TrialSettings


class SharedTarget:
    """A target that runs inwards, never further ahead of the fingers than presses with the closing force.

    Coordinates are the distances (m) of the pads from the plane between them.
    """

    def __init__(self, opening_m: float, settings: TrialSettings):
        self.value_m = opening_m / 2
        self._press_m = settings.force_n / settings.finger_stiffness_n_m
        self._ramp_m = settings.close_speed_m_s * settings.frame_s

    def move_on(self, mean_position_m: float) -> float:
        """Move on by one frame and return the target; ``mean_position_m`` is that of the two fingers."""
        self.value_m = max(self.value_m - self._ramp_m, mean_position_m - self._press_m)
        return self.value_m
