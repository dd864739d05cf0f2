"""Statistics of the grasps that a planner has tried, and their failures."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from manitwin.episodes.planning.problem import PlanFailure, later_failure


@dataclass
class GraspTally:
    """Counts grasps by index; a grasp's failure is that of the attempt that came farthest.

    ``beyond_a_look`` are the grasps that passed the check of the hand alone.
    """

    tried: set[int] = field(default_factory=set)
    beyond_a_look: set[int] = field(default_factory=set)
    failures: dict[int, PlanFailure] = field(default_factory=dict)

    @property
    def count_tried(self) -> int:
        """Number of grasps tried."""
        return len(self.tried)

    @property
    def reasons(self) -> Counter[PlanFailure]:
        """Number of failed grasps by cause."""
        return Counter(self.failures.values())

    def is_new(self, index: int) -> bool:
        """Tell whether a grasp has not been tried beyond the check of the hand alone."""
        return index not in self.beyond_a_look

    def record_failure(self, index: int, failure: PlanFailure) -> None:
        """Count a failed attempt of a grasp."""
        self.tried.add(index)
        self.failures[index] = later_failure(failure, self.failures.get(index, failure))

    def record_success(self, index: int) -> None:
        """Count the planned grasp."""
        self.failures.pop(index, None)
        self.tried.add(index)
