"""Event watches of tool use and pushing: pushed, stirred, wiped, cut motion, aimed.

Like those of ``events``, each processes every step that it is shown; its measurements are judged later (``goals.tool_use``).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from sapien import physx
from scipy.spatial import ConvexHull

from manitwin.episodes.events import Pose
from manitwin.episodes.goals.spatial import MOST_RISE_M
from manitwin.episodes.goals.tool_use import AIMED_M
from manitwin.episodes.goals.world_state import Event
from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import inverse, transform_points
from manitwin.physics.sapien.contacts import ContactReader

# a lifted object that is untouched for LEFT_S and moves less than STILL_M has been put down
LEFT_S, STILL_M = 0.25, 0.001
SECTORS = 12
STIRRED_BAND = (0.15, 1.0)  # in rim radii
STIRRED_DEPTH = 0.3  # share of the vessel's depth, below its rim
CELL_M = 0.01
WIPING_N = (1.0, 5.0)
SMOOTHED_LOOKS = 12  # the force of a single step is noisy; averaged over about a tenth of a second
FACE_RAD = np.radians(15)
FACE_M = 0.002  # points within this distance of the lowest one belong to the face
CUT_OFF_M, CUT_RAD, CUT_STEP_M = 0.005, np.radians(10), 0.005
AIMED_RAD = 0.15


@dataclass
class PushWatch:
    """Records contact of ``subject`` with bodies of the robot, the rise of its ``center``, and its horizontal displacement.

    After a lift, an object that has been at rest and untouched for a quarter of a second is measured anew from there, because
    it may be put somewhere first and pushed then.
    """

    subject: str
    by: frozenset[str]
    center: Callable[[], np.ndarray]
    force_n: float = 0.0
    _start: np.ndarray | None = None
    _now: np.ndarray | None = None
    _rise_m: float = 0.0
    _touched: bool = False
    _left: tuple[float, np.ndarray] | None = None

    @property
    def events(self) -> tuple[Event, ...]:
        """One event if it was touched: ``rise_m``, and ``way_m``, the horizontal displacement from its start."""
        if not self._touched or self._start is None or self._now is None:
            return ()
        way_m = float(np.linalg.norm((self._now - self._start)[:2]))
        return (Event("pushed", self.subject, None, {"rise_m": self._rise_m, "way_m": way_m}),)

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Process the contacts of the last step."""
        push, self._now = reader.resultant_force(contacts, self.subject, self.by), (center := self.center())
        self.force_n = 0.0 if push is None else float(np.linalg.norm(push.force_n))
        self._touched = self._touched or self.force_n > 0
        self._start = center if self._start is None else self._start
        self._rise_m = max(self._rise_m, float(center[2] - self._start[2]))
        if self._rise_m <= MOST_RISE_M or self.force_n > 0:
            self._left = None
        elif self._left is None or np.linalg.norm(center - self._left[1]) > STILL_M:
            self._left = time_s, center
        elif time_s - self._left[0] >= LEFT_S:
            self._start, self._rise_m, self._touched, self._left = center, 0.0, False, None


@dataclass
class StirWatch:
    """Records the sectors of a vessel that a tool's ``end (3,)`` passed through, deeper than 30 % of its depth.

    ``granules`` returns their centres ``(N, 3)``. Values: ``sectors``, the share of the twelve sectors; ``moved``, the share
    of granules that moved by more than their diameter.
    """

    tool: str
    vessel: str
    end: Callable[[], np.ndarray]
    vessel_to_world: Pose
    opening: Opening
    granules: Callable[[], np.ndarray]
    granule_radius_m: float
    force_n: float = 0.0
    _visited: np.ndarray = field(default_factory=lambda: np.zeros(SECTORS, bool))
    _start: np.ndarray | None = None

    @property
    def events(self) -> tuple[Event, ...]:
        """One event if the end was in the vessel."""
        if self._start is None or not self._visited.any():
            return ()
        moved = np.linalg.norm(self.granules() - self._start, axis=1) > 2 * self.granule_radius_m
        values = {"sectors": float(self._visited.mean()), "moved": float(moved.mean())}
        return (Event("stirred", self.tool, self.vessel, values),)

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Record the sector of the vessel that contains the tool's end."""
        if self._start is None:
            self._start = self.granules()
        pose, opening = self.vessel_to_world(), self.opening
        offset = transform_points(inverse(pose), self.end()[None])[0] - opening.center_m
        height_m = float(offset @ opening.axis)
        across = offset - height_m * opening.axis
        out_m = float(np.linalg.norm(across))
        low, high = (share * opening.rim_radius_m for share in STIRRED_BAND)
        if height_m > -STIRRED_DEPTH * opening.depth_m or not low <= out_m <= high:
            return
        x, y = _beside(opening.axis)
        angle = float(np.arctan2(across @ y, across @ x)) % (2 * np.pi)
        self._visited[int(angle / (2 * np.pi) * SECTORS) % SECTORS] = True


@dataclass
class WipeWatch:
    """Records the cells (1 cm) of a level patch that a tool's face swept while pressing on ``surface`` with 1 to 5 N.

    ``patch_to_world`` is the patch's centre with Z up, ``half_m (2,)`` its half extents. ``faces_to_tool (F, 4, 4)`` are the
    frames of the wiping faces, Z outwards, one of which must point down within 15 degrees. Values: ``share`` of swept cells;
    ``force_n``, the mean over the contact time; ``in_band``, the share of that time with a force of 1 to 5 N; ``by_face``,
    the share with a face down.
    """

    tool: str
    surface: str
    place: str
    patch_to_world: np.ndarray
    half_m: np.ndarray
    tool_points_m: np.ndarray
    tool_to_world: Pose
    faces_to_tool: np.ndarray
    force_n: float = 0.0
    _recent: deque[float] = field(default_factory=lambda: deque(maxlen=SMOOTHED_LOOKS))
    _forces: list[float] = field(default_factory=list)
    _by_face: list[bool] = field(default_factory=list)
    _swept: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Create the cells."""
        axes = [np.arange(-half + CELL_M / 2, half, CELL_M) for half in self.half_m]
        self._cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        self._swept = np.zeros(len(self._cells), bool)

    @property
    def events(self) -> tuple[Event, ...]:
        """One event if it touched."""
        if not self._forces:
            return ()
        forces = np.array(self._forces)
        in_band = (forces >= WIPING_N[0]) & (forces <= WIPING_N[1])
        values = {"share": self._swept.mean(), "force_n": forces.mean(), "in_band": in_band.mean()}
        values["by_face"] = np.mean(self._by_face)
        return (Event("wiped", self.tool, self.place, {name: float(value) for name, value in values.items()}),)

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Record the force, and the cells under the face."""
        push = reader.resultant_force(contacts, self.tool, frozenset({self.surface}))
        self._recent.append(0.0 if push is None else float(np.linalg.norm(push.force_n)))
        self.force_n = float(np.mean(self._recent))
        if not any(self._recent):
            return
        tool_to_patch = inverse(self.patch_to_world) @ self.tool_to_world()
        self._forces.append(self.force_n)
        self._by_face.append(bool(((tool_to_patch @ self.faces_to_tool)[:, 2, 2] <= -np.cos(FACE_RAD)).any()))
        if not self._by_face[-1] or not WIPING_N[0] <= self.force_n <= WIPING_N[1]:
            return
        points = transform_points(tool_to_patch, self.tool_points_m)
        face = points[points[:, 2] < points[:, 2].min() + FACE_M, :2]
        if len(face) < 3 or np.linalg.matrix_rank(face - face[0], tol=1e-4) < 2:
            return
        planes = ConvexHull(face).equations
        self._swept |= (self._cells @ planes[:, :2].T + planes[:, 2] <= 0).all(1)


@dataclass
class CutWatch:
    """Records how much of a line an edge moved along: within 5 mm, and within 10 degrees of its direction and of upright.

    ``line_to_world`` has its origin at the line's centre, X along it, Z up; ``edge`` returns the edge's frame (X along it, Z
    outwards). Values: ``share`` of the line; ``drawn``, the edge's travel along it over the line's length; ``off_m`` and
    ``angle_rad`` at the smallest distance.
    """

    tool: str
    place: str
    line_to_world: np.ndarray
    length_m: float
    edge: Pose
    edge_length_m: float
    force_n: float = 0.0
    _off_m: float = np.inf
    _angle_rad: float = np.inf
    _along_m: tuple[float, float] = (np.inf, -np.inf)
    _met: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Create the sample points along the line."""
        self._places_m = np.arange(-self.length_m / 2, self.length_m / 2 + 1e-9, CUT_STEP_M)
        self._met = np.zeros(len(self._places_m), bool)

    @property
    def events(self) -> tuple[Event, ...]:
        """One event if the edge came near."""
        if not np.isfinite(self._off_m):
            return ()
        drawn = max(self._along_m[1] - self._along_m[0], 0.0) / self.length_m
        values = {"share": float(self._met.mean()), "drawn": drawn, "off_m": self._off_m, "angle_rad": self._angle_rad}
        return (Event("cut_motion", self.tool, self.place, values),)

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Record the edge's pose relative to the line."""
        edge = inverse(self.line_to_world) @ self.edge()
        along = edge[:3, 0] * (1.0 if edge[0, 0] >= 0 else -1.0)
        cosines = np.clip([along[0], -edge[2, 2]], -1, 1)
        angle_rad = float(np.arccos(cosines).max())
        to_line = (self._places_m - edge[0, 3]) / max(along[0], 1e-6)
        beside = edge[1:3, 3] + to_line[:, None] * along[1:]
        off_m = np.where(np.abs(to_line) <= self.edge_length_m / 2, np.linalg.norm(beside, axis=1), np.inf)
        if angle_rad <= CUT_RAD and (off_m <= CUT_OFF_M).any():
            self._met |= off_m <= CUT_OFF_M
            at_m = float(edge[0, 3])
            self._along_m = min(self._along_m[0], at_m), max(self._along_m[1], at_m)
        if off_m.min() < self._off_m:
            self._off_m, self._angle_rad = float(off_m.min()), angle_rad


@dataclass
class AimWatch:
    """Records the longest time for which a nozzle (Z outwards) pointed at ``target (3,)``, and the best alignment."""

    tool: str
    second: str
    nozzle: Pose
    target: Callable[[], np.ndarray]
    timestep_s: float
    force_n: float = 0.0
    _looks: int = 0
    _longest: int = 0
    _best: tuple[float, float] | None = None

    @property
    def events(self) -> tuple[Event, ...]:
        """One event: ``angle_rad`` and ``distance_m`` at the best alignment, ``held_s``."""
        if self._best is None:
            return ()
        values = {"angle_rad": self._best[0], "distance_m": self._best[1], "held_s": self._longest * self.timestep_s}
        return (Event("aimed", self.tool, self.second, values),)

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Record the nozzle's direction."""
        nozzle = self.nozzle()
        way = self.target() - nozzle[:3, 3]
        distance_m = float(np.linalg.norm(way))
        across_m = float(np.linalg.norm(np.cross(nozzle[:3, 2], way)))
        # atan2, because arccos would return 0 for half a milliradian
        angle_rad = float(np.arctan2(across_m, nozzle[:3, 2] @ way))
        on_it = angle_rad <= AIMED_RAD and AIMED_M[0] <= distance_m <= AIMED_M[1]
        self._looks = self._looks + 1 if on_it else 0
        self._longest = max(self._longest, self._looks)
        if self._best is None or angle_rad < self._best[0]:
            self._best = angle_rad, distance_m


def _beside(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two orthogonal directions perpendicular to an axis ``(3,)``."""
    x = np.cross(axis, [0.0, 1.0, 0.0] if abs(axis[1]) < 0.9 else [1.0, 0.0, 0.0])
    x = x / np.linalg.norm(x)
    return x, np.cross(axis, x)
