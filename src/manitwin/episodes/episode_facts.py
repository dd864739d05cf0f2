"""The result of an episode: the part of an ``Attempt`` that the execution knows."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from manitwin.episodes.goals.evaluation import Evaluation
from manitwin.episodes.goals.world_state import Event
from manitwin.episodes.outcome import PlacementErrors
from manitwin.episodes.planning.problem import Grasp, PlanFailure


@dataclass
class EpisodeFacts:
    """What became of an episode; ``replans`` counts what was planned anew and where that failed.

    ``taker_grasp`` is that of the second arm, to which the target is handed over.
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
