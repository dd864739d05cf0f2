"""What the planner may spend, and how far from things it keeps."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PlannerSettings:
    """Lengths in metres, work in counts: no clock decides what is found.

    ``margin_m`` is kept in free motion, and lowered step by step to ``clearance_m`` where start or goal are nearer;
    ``clearance_m`` is kept on straight lines. Defaults: 10 mm of margin, so that no thin part passes between two
    checks of a path (every 0.02 rad); 10 cm approach, 12 cm lift.
    """

    approach_m: float = 0.10
    lift_m: float = 0.12
    margin_m: float = 0.010
    clearance_m: float = 0.001
    check_step_rad: float = 0.02
    check_step_m: float = 0.005
    search_step_rad: float = 0.05
    extension_rad: float = 1.0
    iterations: int = 400
    shortcuts: int = 30
    max_grasps: int = 40
    starts: int = 6
    solutions: int = 2
