"""Falling bodies: a larger contact offset and slower depenetration keep them from being thrown out of a surface on impact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from sapien import physx

from manitwin.physics.sapien.body import MAX_DEPENETRATION_M_S
from manitwin.physics.trial import GRAVITY_M_S2

# After a fall of 10 cm, a body moves 12 mm per step of 1/120 s. With depenetration at 5 m/s, a marker that fell 11 cm into a
# holder flew over its rim; with slow depenetration alone, another one stayed wedged in the holder's walls and vibrated there.
GENTLY_M_S = 0.5
AHEAD_M = 0.012
OFF_GRAVITY = 0.1  # relative tolerance of the acceleration for which a body counts as falling freely


class FreeFallLimiter:
    """Limits the depenetration speed of bodies from when they fall freely until a hand closes again."""

    def __init__(
        self, bodies: Sequence[physx.PhysxRigidDynamicComponent], timestep_s: float, *, contact_offset_m: float
    ):
        """Watch bodies of a scene with gravity along -Z; ``contact_offset_m`` is their usual contact offset."""
        self._contact_offset_m = contact_offset_m
        self._bodies, self._step_m_s = bodies, np.array([0.0, 0, -GRAVITY_M_S2 * timestep_s])
        self._before_m_s = [np.array(body.linear_velocity, float) for body in bodies]
        self._falls = [False] * len(bodies)

    def look(self) -> None:
        """Detect bodies in free fall; call after each step."""
        for number, body in enumerate(self._bodies):
            velocity_m_s = np.array(body.linear_velocity, float)
            off_m_s = velocity_m_s - self._before_m_s[number] - self._step_m_s
            self._before_m_s[number] = velocity_m_s
            if not self._falls[number] and off_m_s @ off_m_s < (OFF_GRAVITY * self._step_m_s[2]) ** 2:
                self._limit(number, falls=True)

    def end(self) -> None:
        """Restore the usual limits: a closing hand needs fast depenetration to push light objects off its fingers."""
        for number, falls in enumerate(self._falls):
            if falls:
                self._limit(number, falls=False)

    def _limit(self, number: int, *, falls: bool) -> None:
        self._falls[number] = falls
        self._bodies[number].max_depenetration_velocity = GENTLY_M_S if falls else MAX_DEPENETRATION_M_S
        for shape in self._bodies[number].collision_shapes:
            shape.contact_offset = AHEAD_M if falls else self._contact_offset_m
