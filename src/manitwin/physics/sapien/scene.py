"""PhysX systems and scenes of SAPIEN with explicit settings, independent of the process-wide configuration."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import sapien
from sapien import physx

from manitwin.physics.trial import GRAVITY_M_S2


@contextmanager
def scene_config(**values: object) -> Iterator[None]:
    """Set SAPIEN's process-wide scene configuration, which new systems use, and restore it at exit."""
    before = physx.get_scene_config()
    kept = {name: getattr(before, name) for name in values}
    config = physx.get_scene_config()
    for name, value in values.items():
        setattr(config, name, value)
    physx.set_scene_config(config)
    try:
        yield
    finally:
        for name, value in kept.items():
            setattr(config, name, value)
        physx.set_scene_config(config)


def system_with_gravity(timestep_s: float) -> physx.PhysxCpuSystem:
    """Return a system with gravity along -Z."""
    with scene_config(gravity=np.array([0, 0, -GRAVITY_M_S2], np.float32)):
        system = physx.PhysxCpuSystem()
    system.timestep = timestep_s
    return system


def scene_with_gravity(timestep_s: float) -> sapien.Scene:
    """Return a scene whose only system has gravity along -Z."""
    return sapien.Scene([system_with_gravity(timestep_s)])


def weightless_system(timestep_s: float) -> physx.PhysxCpuSystem:
    """Return a system without gravity, for a stationary hand and its object."""
    with scene_config(gravity=[0, 0, 0], bounce_threshold=2.0, enable_enhanced_determinism=False):
        system = physx.PhysxCpuSystem()
    system.timestep = timestep_s
    return system
