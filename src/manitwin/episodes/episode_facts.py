"""Result of an episode: the part of an ``Attempt`` that the execution determines."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from manitwin.episodes.goals.evaluation import Evaluation
from manitwin.episodes.goals.world_state import Event
from manitwin.episodes.outcome import PlacementErrors
from manitwin.episodes.planning.problem import Grasp, PlanFailure


@dataclass
class EpisodeFacts:
    """Facts of an episode; ``replans`` counts replanning results by name.

    ``taker_grasp`` is the second arm's grasp in a handover.
    """

    outcome: str = "no_plan"
    grasp: Grasp | None = None
    taker_grasp: Grasp | None = None
    grasps_tried: int = 0
    plan_failures: Counter[PlanFailure] = field(default_factory=Counter)
    errors: PlacementErrors | None = None
    slip_m: float | None = None
    length_s: float | None = None
    unplanned: tuple[tuple[str, str], ...] = ()
    evaluation: Evaluation | None = None
    events: tuple[Event, ...] = ()
    replans: Counter[str] = field(default_factory=Counter)
