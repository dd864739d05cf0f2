"""Points that others take grasps from are searched themselves, before anything is said of them."""

from __future__ import annotations

from collections import Counter

from manitwin.pipeline.point_trials import resolve_grasp_points
from manitwin.twin.point_records import GraspPoint

ENOUGH = 10


class FakeSearch:
    """Holds at each candidate what is said for it, less what others that are there take; a search finds nothing more."""

    def __init__(self, held: dict[int, int], taken: dict[tuple[int, int], int]):
        self._held, self._taken = held, taken
        self.passed: dict[int, Counter[str]] = {}

    def outcomes_at(self, point: GraspPoint, others: list[GraspPoint]) -> Counter[str]:
        lost = sum(self._taken.get((other.candidate, point.candidate), 0) for other in others)
        return Counter(held=self._held[point.candidate] - lost)

    def has_shortfall(self, point: GraspPoint, others: list[GraspPoint]) -> bool:
        return self.outcomes_at(point, others)["held"] < ENOUGH

    def search(self, point: GraspPoint, others: list[GraspPoint]) -> None:
        self.passed[point.candidate] = Counter(raw=5)

    def shortfall(self, point: GraspPoint, others: list[GraspPoint]) -> str:
        if not self.has_shortfall(point, others):
            return ""
        return f"proposals there: {self.passed[point.candidate]['raw']}"


def point(candidate: int) -> GraspPoint:
    return GraspPoint(
        id=f"g{candidate}", candidate=candidate, position_m=[0.01 * candidate, 0.0, 0.0], normal=[1.0, 0.0, 0.0],
        type="pinch", scenario="holding it", confidence=0.8, rationale="its body",
    )  # fmt: skip


def test_a_point_that_a_spare_takes_everything_from_is_searched_before_it_is_withdrawn() -> None:
    search = FakeSearch({0: 0, 1: 12, 7: 15, 8: 11}, {(7, 1): 12})
    answered = resolve_grasp_points(search, [point(0), point(1)], [point(7), point(8)])  # type: ignore[arg-type]
    assert [each["candidate"] for each in answered["grasp"]] == [7, 8]
    assert set(search.passed) == {0, 1}
    assert [(each["candidate"], each["shortfall"]) for each in answered["withdrawn"]] == [
        (0, "proposals there: 5"),
        (1, "proposals there: 5"),
    ]


def test_a_spare_with_enough_from_which_a_later_one_takes_is_searched_too() -> None:
    search = FakeSearch({0: 0, 1: 0, 7: 15, 8: 14}, {(8, 7): 9})
    answered = resolve_grasp_points(search, [point(0), point(1)], [point(7), point(8)])  # type: ignore[arg-type]
    assert [each["candidate"] for each in answered["grasp"]] == [7, 8]
    assert 7 in search.passed and answered["grasp"][0]["shortfall"]
    assert not answered["grasp"][1]["shortfall"]
