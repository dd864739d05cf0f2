"""Find the poses in which the object stays when it is set down on a plane (paper, "Consolidated Output": placements)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from manitwin.config import PlacementConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.geometry.boxes import smallest_enclosing_circle
from manitwin.geometry.hulls.reduction import convex_corners
from manitwin.geometry.poses import quaternion_wxyz, rotation_between, transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.geometry.stable_poses import easiest_tilt, stable_poses
from manitwin.pipeline.object_state import load_body, load_solid
from manitwin.twin.resting import rest_of

if TYPE_CHECKING:
    from manitwin.physics.sapien.settle import Settled

UP = np.array([0.0, 0.0, 1.0])
SAME_POSE_DEG = 5.0
SNAP_DEG = 3.0
NUDGE_DEG = 4.0
MOST_POSES = 500  # of a ball's thousands: no 12 degrees are then without one
# Of 371 quasi-static poses of 25 objects, 7 of the 52 that rise by 0.5 to 1 of tilt_rise_m turned by more than 5 degrees
# when released in MuJoCo, but none of the 17 that also pass the trial of loose poses; below a half, 110 of the 189.
LOOSE_SHARE = 0.5
SPARE_TRIALS = 2  # poses tried beyond those kept: some of the likeliest may roll away


@dataclass(frozen=True, eq=False)
class _Rest:
    """A way to rest: ``rotation (3, 3)`` object to plane, its probability, and whether it stayed in simulation."""

    rotation: np.ndarray
    probability: float
    settled: bool = False

    @property
    def up(self) -> np.ndarray:
        """The direction of the object that points up."""
        return self.rotation[2]


@dataclass(frozen=True)
class PlacementStage:
    """Find stable poses and prove them in simulation.

    Field ``placements``: a list of twin.Placement, those that stayed first, most likely first.
    """

    settings: PlacementConfig

    name: ClassVar[str] = "placement"
    version: ClassVar[str] = "6"
    reads: ClassVar[tuple[str, ...]] = ("hulls.npz", "solid.npz", "physical")
    writes: ClassVar[tuple[str, ...]] = ("placements",)
    needs: ClassVar[Resource] = "cpu"
    backend: ClassVar[str] = "sapien, mujoco"
    model: ClassVar[str | None] = None

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Return the field ``placements``; raises Rejected where the object stays in no pose."""
        body = load_body(draft)
        rests = find_rests(body, self.settings)
        outline = convex_corners(np.vstack([load_solid(draft.path("solid.npz")).vertices, *body.hulls]))[0]
        return {"placements": [_placement(rest, outline, np.vstack(body.hulls)) for rest in rests]}


def find_rests(body: RigidBody, settings: PlacementConfig) -> list[_Rest]:
    """Return the ways in which a body rests on a plane: those that stay in simulation first, most likely first.

    A pose that a slight tilt turns over (a can on its side) does not count as staying. Where no likely pose is firm,
    the loose ones count that pass the harder trial, else the firm ones that are unlikely (a pencil on its end). The upright pose
    always counts where it passes that trial: in it people put down a spoon, which stands on little. What falls over is tried
    once more from where it came to rest. Raises Rejected where nothing stays.
    """
    shape = _Shape(body, settings)
    guesses, unlikely = shape.guesses()
    firm = [guess for guess in guesses if shape.is_firm(guess.rotation)]
    loose = [guess for guess in guesses if not shape.is_firm(guess.rotation)]
    rests = shape.tried(firm, loosely=False)
    proven = any(rest.settled for rest in rests)
    rests += shape.tried([guess for guess in loose if not proven or _is_upright(guess)], loosely=True)
    rests += [guess for guess in loose if proven and not _is_upright(guess)]
    if not any(rest.settled for rest in rests):
        rests += shape.tried([guess for guess in unlikely if shape.is_firm(guess.rotation)], loosely=False)
    rests = [rest for rest in rests if rest.settled or rest.probability >= settings.least_probability]
    rests.sort(key=lambda rest: (not rest.settled, -rest.probability))
    if not rests or not rests[0].settled:
        raise Rejected(
            "no_stable_pose",
            f"the object rolled or tipped over from each of the {len(guesses)} most likely resting poses",
        )
    upright = [rest for rest in rests[settings.max_placements :] if rest.settled and _is_upright(rest)][:1]
    return rests[: settings.max_placements - len(upright)] + upright


class _Shape:
    """A body's convex hull and its quasi-static poses."""

    def __init__(self, body: RigidBody, settings: PlacementConfig):
        self.body, self.settings = body, settings
        self.corners = convex_corners(np.vstack(body.hulls))[0]
        outermost = set(map(tuple, self.corners))
        touching = tuple(hull for hull in body.hulls if not outermost.isdisjoint(map(tuple, hull)))
        self.plane_body = replace(body, hulls=touching)  # the others cannot reach a plane, but cost time
        poses = stable_poses(self.corners, body.center_of_mass_m)[:MOST_POSES]
        self.rotations = np.array([pose.rotation for pose in poses])
        self.probabilities = np.array([pose.probability for pose in poses])
        self.rises = self._rises(self.rotations)

    def _rises(self, rotations: np.ndarray) -> np.ndarray:
        tilt_rad = np.radians(self.settings.max_turned_deg)
        return easiest_tilt(self.corners, self.body.center_of_mass_m, rotations, tilt_rad)[0]

    def is_firm(self, rotation: np.ndarray) -> bool:
        """Tell whether a slight tilt does not turn the body over."""
        return self.rises_by(rotation, self.settings.tilt_rise_m)

    def rises_by(self, rotation: np.ndarray, least_m: float) -> bool:
        """Tell whether a slight tilt raises the centre of mass by no less than ``least_m``."""
        return bool(self._rises(rotation[None])[0] >= least_m)

    def guesses(self) -> tuple[list[_Rest], list[_Rest]]:
        """Return the likeliest poses and the upright one, and as many unlikely; of poses that roll into each other one.

        That is the firmest. A round side is many narrow facets: each a pose to the estimator, all of them one to a
        person.
        """
        near = self.rotations[:, 2] @ self.rotations[:, 2].T > np.cos(np.radians(self.settings.merge_deg))
        _, family = connected_components(csr_matrix(near), directed=False)
        guesses = []
        for label in range(family.max() + 1):
            members = np.flatnonzero(family == label)
            firmest = members[int(self.rises[members].argmax())]
            guesses.append(_Rest(self.rotations[firmest], min(1.0, float(self.probabilities[members].sum()))))
        guesses.sort(key=lambda guess: -guess.probability)
        most = self.settings.max_placements + SPARE_TRIALS
        likely = [guess for guess in guesses if guess.probability >= self.settings.least_probability][:most]
        unlikely = [guess for guess in guesses if guess.probability < self.settings.least_probability][:most]
        standing = [guess for guess in guesses if _is_upright(guess)] or [_Rest(np.eye(3), 0.0)]
        return (likely if any(_is_upright(guess) for guess in likely) else [*likely, standing[0]]), unlikely

    def settle(self, rests: list[_Rest], loosely: bool) -> list[tuple[Settled, bool]]:
        """Set the body down in simulation in each of the poses; tell where it went, and whether it stayed.

        Staying is judged level in two engines, and in the first one nudged, tilted by ``NUDGE_DEG`` the way it tilts most
        easily: it must not go on. A body that rests ``loosely`` is nudged the other way too, and must fall back to within
        ``SNAP_DEG`` from both.
        """
        from manitwin.physics.sapien.settle import (
            settle_on_plane,  # an engine loads when a stage runs, not with the recipe
        )

        if not rests:
            return []
        level = np.array([rest.rotation for rest in rests])
        nudged = easiest_tilt(self.corners, self.body.center_of_mass_m, level, np.radians(NUDGE_DEG))[1]
        landings = [level, nudged]
        if loosely:
            landings.append(level @ nudged.transpose(0, 2, 1) @ level)  # the same tilt the other way
        poses = [
            transform(rotation, np.array([0, 0, -float((self.corners @ rotation[2]).min())]))
            for rotation in np.concatenate(landings)
        ]
        outcomes = settle_on_plane(self.plane_body, poses, drop_m=self.settings.drop_m, seconds=self.settings.seconds)
        most_rad = np.radians(self.settings.max_turned_deg)
        back_rad = np.radians(SNAP_DEG) if loosely else most_rad + np.radians(NUDGE_DEG)
        found = []
        for index, rotation in enumerate(level):
            first, *others = outcomes[index :: len(level)]
            tilts = [tilted[index] for tilted in landings[1:]]
            back = all(
                self._stayed(other, rotation, back_rad, self._way_back_m(tilt))
                for other, tilt in zip(others, tilts, strict=True)
            )
            stayed = back and self._stayed(first, rotation, most_rad)
            found.append((first, stayed and self._stays_in_second_engine(poses[index], rotation, most_rad)))
        return found

    def _stays_in_second_engine(self, pose: np.ndarray, level: np.ndarray, most_rad: float) -> bool:
        """Tell whether the body stays in another solver too: on a narrow facet, the two need not agree."""
        from manitwin.physics.mujoco.settle import settle_on_plane_in_mujoco

        drop_m, seconds = self.settings.drop_m, self.settings.seconds
        again = settle_on_plane_in_mujoco(self.plane_body, [pose], drop_m=drop_m, seconds=seconds)[0]
        return self._stayed(again, level, most_rad)

    def _stayed(self, outcome: Settled, level: np.ndarray, most_rad: float, way_back_m: float = 0.0) -> bool:
        """Tell whether a body ended near ``level``, its centre of mass at most ``way_back_m`` beyond the limit from its start."""
        turned_rad = Rotation.from_matrix(outcome.object_to_plane[:3, :3] @ level.T).magnitude()
        return bool(outcome.moved_m < self.settings.max_moved_m + way_back_m and turned_rad < most_rad)

    def _way_back_m(self, tilted: np.ndarray) -> float:
        """Return how far the centre of mass goes where a nudged body falls back over the point that it stands on.

        That is no movement of the body: of a tall one it alone is more than ``max_moved_m``.
        """
        offsets = self.corners - self.body.center_of_mass_m
        pivot = offsets[int((offsets @ tilted[2]).argmin())]
        return float(np.linalg.norm(pivot)) * np.radians(NUDGE_DEG)

    def tried(self, guesses: list[_Rest], loosely: bool) -> list[_Rest]:
        """Set the body down in each pose and say where it stays; again from where it fell to, if that is no worse.

        Poses that a slight tilt hardly raises are not tried: a solver's own friction would hold a cylinder.
        """
        least_rise_m = self.settings.tilt_rise_m * (LOOSE_SHARE if loosely else 1.0)
        rests = [guess for guess in guesses if not self.rises_by(guess.rotation, least_rise_m)]
        guesses = [guess for guess in guesses if self.rises_by(guess.rotation, least_rise_m)]
        fallen: list[_Rest] = []
        for guess, (outcome, stayed) in zip(guesses, self.settle(guesses, loosely), strict=True):
            found = replace(guess, rotation=self.resting(guess, outcome), settled=stayed)
            if stayed:
                _add(rests, found)
            elif outcome.at_rest and self.rises_by(found.rotation, least_rise_m):
                fallen.append(found)
            else:
                rests.append(guess)
        fallen = [found for found in fallen if not _joined(rests, found)]
        for found, (_, stayed) in zip(fallen, self.settle(fallen, loosely), strict=True):
            _add(rests, replace(found, settled=stayed))
        return rests

    def resting(self, start: _Rest, outcome: Settled) -> np.ndarray:
        """Return the orientation in which the body came to rest, with the heading it started with.

        That of the firmest quasi-static pose within ``SNAP_DEG`` of where it ended; the start itself is one of them
        where it stayed. Solvers leave a body tilted by their contact tolerance, and another one lets it roll off from
        there.
        """
        up = outcome.object_to_plane[2, :3]
        cosine = np.cos(np.radians(SNAP_DEG))
        if float(start.up @ up) > np.cos(np.radians(self.settings.max_turned_deg)):
            cosine = min(cosine, float(start.up @ up) - 1e-9)
        close = np.flatnonzero(self.rotations[:, 2] @ up > cosine)
        if len(close):
            up = self.rotations[close[int(self.rises[close].argmax())], 2]
        return start.rotation @ rotation_between(up, start.up)


def _joined(rests: list[_Rest], found: _Rest) -> bool:
    """Give the probability of a pose to an equal one that stayed; tell whether there is one."""
    for index, rest in enumerate(rests):
        if rest.settled and float(rest.up @ found.up) > np.cos(np.radians(SAME_POSE_DEG)):
            rests[index] = replace(rest, probability=min(1.0, rest.probability + found.probability))
            return True
    return False


def _add(rests: list[_Rest], found: _Rest) -> None:
    if not (found.settled and _joined(rests, found)):
        rests.append(found)


def _is_upright(rest: _Rest) -> bool:
    return rest_of(rest.rotation) == "upright"


def _placement(rest: _Rest, outline: np.ndarray, hull_points: np.ndarray) -> dict[str, Any]:
    """Return a twin.Placement: the plane frame's origin is the centre of the circle around the projection."""
    center, radius = smallest_enclosing_circle((outline @ rest.rotation.T)[:, :2])
    height = -float((hull_points @ rest.up).min())
    return {
        "position_m": [-float(center[0]), -float(center[1]), height],
        "quaternion_wxyz": quaternion_wxyz(rest.rotation).tolist(),
        "probability": rest.probability,
        "upright": _is_upright(rest),
        "settled": bool(rest.settled),
        "collision_radius_m": radius,
    }
