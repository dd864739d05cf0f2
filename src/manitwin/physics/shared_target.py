"""The closing of a parallel hand: one position target for both fingers.

It is what the mechanical coupling of the real hand does; two independently saturated fingers have no lateral stiffness
and drift by centimetres.
"""

from __future__ import annotations

from manitwin.physics.trial import TrialSettings

MET_M = 1e-6


class SharedTarget:
    """A target that runs inwards, never further ahead of the fingers than presses with the closing force.

    Coordinates are the distances (m) of the pads from the plane between them. Pads that meet (``met_m`` and less) have
    nothing between them, whatever they overlap: the target goes back to where it was, as a gripper opens again that
    reports an empty hand. Without this, fingers that have tunnelled into a thin and light object hold it.
    """

    def __init__(self, opening_m: float, settings: TrialSettings, met_m: float = MET_M):
        self.value_m = self._open_m = opening_m / 2
        self._met_m, self._met = met_m, False
        self._press_m = settings.force_n / settings.finger_stiffness_n_m
        self._ramp_m = settings.close_speed_m_s * settings.frame_s

    def move_on(self, mean_position_m: float) -> float:
        """Move on by one frame and return the target; ``mean_position_m`` is that of the two fingers."""
        self._met = self._met or mean_position_m <= self._met_m
        if self._met:
            self.value_m = self._open_m
            return self.value_m
        self.value_m = max(self.value_m - self._ramp_m, mean_position_m - self._press_m)
        return self.value_m
