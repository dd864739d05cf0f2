"""RRT-Connect (Kuffner and LaValle, ICRA 2000) in joint space, with effort limited by iterations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from manitwin.episodes.planning.joint_paths import is_segment_free

IsFree = Callable[[np.ndarray], bool]


class _Tree:
    """Configurations and their parents."""

    def __init__(self, root: np.ndarray):
        self._nodes, self._parents = np.empty((64, len(root))), [-1]
        self._nodes[0] = root

    def add(self, configuration: np.ndarray, parent: int) -> int:
        count = len(self._parents)
        if count == len(self._nodes):
            self._nodes = np.concatenate([self._nodes, np.empty_like(self._nodes)])
        self._nodes[count] = configuration
        self._parents.append(parent)
        return count

    def nearest(self, configuration: np.ndarray) -> int:
        offsets = self._nodes[: len(self._parents)] - configuration
        return int(np.einsum("ij,ij->i", offsets, offsets).argmin())

    def at(self, index: int) -> np.ndarray:
        return self._nodes[index].copy()

    def to_root(self, index: int) -> list[np.ndarray]:
        way = []
        while index >= 0:
            way.append(self.at(index))
            index = self._parents[index]
        return way


def rrt_connect(
    start: np.ndarray,
    goal: np.ndarray,
    is_free: IsFree,
    limits: tuple[np.ndarray, np.ndarray],
    rng: np.random.Generator,
    *,
    extension_rad: float,
    check_step_rad: float,
    iterations: int,
) -> np.ndarray | None:
    """Return waypoints ``(N, n)`` from start to goal, or None after ``iterations``; start and goal must be free."""
    from_start, from_goal = _Tree(start), _Tree(goal)
    growing, other = from_start, from_goal

    def extend(tree: _Tree, target: np.ndarray) -> tuple[int, bool] | None:
        nearest = tree.nearest(target)
        origin = tree.at(nearest)
        way = target - origin
        length = float(np.linalg.norm(way))
        reaches = length <= extension_rad
        end = target if reaches else origin + way * (extension_rad / length)
        if not is_segment_free(origin, end, is_free, check_step_rad):
            return None
        return tree.add(end, nearest), reaches

    for _ in range(iterations):
        grown = extend(growing, rng.uniform(*limits))
        if grown is not None:
            target = growing.at(grown[0])
            met = extend(other, target)
            while met is not None and not met[1]:
                met = extend(other, target)
            if met is not None:
                first, second = growing.to_root(grown[0]), other.to_root(met[0])
                if growing is from_goal:
                    first, second = second, first
                return np.array(first[::-1] + second[1:])
        growing, other = other, growing
    return None
