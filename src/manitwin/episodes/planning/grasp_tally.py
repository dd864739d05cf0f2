"""The grasps that a planner has tried, beyond a look or not, and what they failed of."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from manitwin.episodes.planning.problem import PlanFailure, later


@dataclass
class GraspTally:
    """Counts grasps by their numbers; a grasp fails by the cause of that try which came the farthest."""

    tried: set[int] = field(default_factory=set)
    beyond_a_look: set[int] = field(default_factory=set)
    failures: dict[int, PlanFailure] = field(default_factory=dict)

    @property
    def count_tried(self) -> int:
        """How many grasps were tried."""
        return len(self.tried)

    @property
    def reasons(self) -> Counter[PlanFailure]:
        """How many grasps failed by each cause."""
        return Counter(self.failures.values())

    def is_new(self, index: int) -> bool:
        """Tell whether a grasp has not been tried beyond a look."""
        return index not in self.beyond_a_look

    def count(self, index: int, failure: PlanFailure) -> None:
        """Count a try of a grasp, by its number, that failed."""
        self.tried.add(index)
        self.failures[index] = later(failure, self.failures.get(index, failure))

    def succeed(self, index: int) -> None:
        """Count the grasp that was planned."""
        self.failures.pop(index, None)
        self.tried.add(index)
