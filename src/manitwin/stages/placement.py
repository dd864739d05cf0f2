"""The poses in which the object stays when it is set down on a plane."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from manitwin.config import PlacementConfig
from manitwin.errors import Rejected
from manitwin.geometry.boxes import smallest_enclosing_circle
from manitwin.geometry.hull_reduction import convex_corners
from manitwin.geometry.poses import quaternion_wxyz, rotation_between, transform
from manitwin.geometry.stable_poses import easiest_tilt, stable_poses
from manitwin.simulate.settle import RigidBody, Settled, settle_on_plane
from manitwin.stages.object_arrays import load_hulls, load_solid
from manitwin.stages.stage import Draft, Resource

UP = np.array([0.0, 0.0, 1.0])
UPRIGHT_DEG = 10.0
SAME_POSE_DEG = 5.0
SNAP_DEG = 3.0
NUDGE_DEG = 4.0
MOST_POSES = 500  # of a ball's thousands: no 12 degrees are then without one
SPARE_TRIALS = 2  # poses tried beyond those kept: some of the likeliest may roll away


@dataclass(frozen=True, eq=False)
class _Rest:
    """A way to rest: ``rotation (3, 3)`` object to plane, its probability, and whether it stayed in simulation."""

    rotation: np.ndarray
    probability: float
    settled: bool

    @property
    def up(self) -> np.ndarray:
        """The direction of the object that points up."""
        return self.rotation[2]


class PlacementStage:
    """Find stable poses and prove them in simulation.

    Field ``placements``: a list of twin.Placement, those that stayed first, most likely first.
    """

    name: ClassVar[str] = "placement"
    version: ClassVar[str] = "1"
    reads: ClassVar[tuple[str, ...]] = ("hulls.npz", "solid.npz", "physical")
    writes: ClassVar[tuple[str, ...]] = ("placements",)
    needs: ClassVar[Resource] = "cpu"
    backend = "sapien"
    model: str | None = None

    def __init__(self, settings: PlacementConfig):
        """Take the settings."""
        self.settings = settings

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Return the field ``placements``; raises Rejected where the object stays in no pose."""
        hulls = load_hulls(draft.path("hulls.npz"))
        physical = draft.field("physical")
        body = RigidBody(
            hulls=hulls,
            mass_kg=physical["mass_kg"]["value"],
            center_of_mass_m=np.array(physical["center_of_mass_m"]),
            inertia_kg_m2=np.array(physical["inertia_kg_m2"]),
            friction_static=physical["friction_static"]["value"],
            friction_dynamic=physical["friction_dynamic"]["value"],
        )
        rests = find_rests(body, self.settings)
        outline = np.vstack([load_solid(draft.path("solid.npz")).vertices, *hulls])
        return {"placements": [_placement(rest, outline, np.vstack(hulls)) for rest in rests]}


def find_rests(body: RigidBody, settings: PlacementConfig) -> list[_Rest]:
    """Return the ways in which a body rests on a plane: those that stay in simulation first, most likely first.

    A pose that a slight tilt turns over (a can on its side) does not count as staying, unless there is no other. What
    falls over is tried once more from where it came to rest. Raises Rejected where nothing stays.
    """
    shape = _Shape(body, settings)
    guesses = shape.guesses()
    firm = [guess for guess in guesses if shape.is_firm(guess.rotation)]
    loose = [guess for guess in guesses if not shape.is_firm(guess.rotation)]
    rests = shape.tried(firm, again_if=shape.is_firm)
    if not any(rest.settled for rest in rests):
        rests = shape.tried(loose, again_if=lambda rotation: True)
    else:
        rests += loose
    rests = [rest for rest in rests if rest.settled or rest.probability >= settings.least_probability]
    rests.sort(key=lambda rest: (not rest.settled, -rest.probability))
    if not rests or not rests[0].settled:
        raise Rejected(
            "no_stable_pose",
            f"it rolled or tipped over from each of the {len(guesses)} likeliest poses it was set down in",
        )
    upright = [rest for rest in rests[settings.max_placements :] if rest.settled and _is_upright(rest)][:1]
    return rests[: settings.max_placements - len(upright)] + upright


class _Shape:
    """A body's convex hull and its quasi-static poses."""

    def __init__(self, body: RigidBody, settings: PlacementConfig):
        self.body, self.settings = body, settings
        self.corners = convex_corners(np.vstack(body.hulls))[0]
        poses = stable_poses(self.corners, body.center_of_mass_m)[:MOST_POSES]
        self.rotations = np.array([pose.rotation for pose in poses])
        self.probabilities = np.array([pose.probability for pose in poses])
        self.rises = self._rises(self.rotations)

    def _rises(self, rotations: np.ndarray) -> np.ndarray:
        tilt_rad = np.radians(self.settings.max_turned_deg)
        return easiest_tilt(self.corners, self.body.center_of_mass_m, rotations, tilt_rad)[0]

    def is_firm(self, rotation: np.ndarray) -> bool:
        """Tell whether a slight tilt does not turn the body over."""
        return bool(self._rises(rotation[None])[0] >= self.settings.tilt_rise_m)

    def guesses(self) -> list[_Rest]:
        """Return the likeliest poses and the upright one, of poses that roll into each other the firmest.

        A round side is many narrow facets: each a pose to the estimator, all of them one to a person.
        """
        near = self.rotations[:, 2] @ self.rotations[:, 2].T > np.cos(np.radians(self.settings.merge_deg))
        _, family = connected_components(csr_matrix(near), directed=False)
        guesses = []
        for label in range(family.max() + 1):
            members = np.flatnonzero(family == label)
            firmest = members[int(self.rises[members].argmax())]
            guesses.append(_Rest(self.rotations[firmest], min(1.0, float(self.probabilities[members].sum())), False))
        guesses.sort(key=lambda guess: -guess.probability)
        most = self.settings.max_placements + SPARE_TRIALS
        likely = [guess for guess in guesses if guess.probability >= self.settings.least_probability][:most]
        standing = [guess for guess in guesses if _is_upright(guess)] or [_Rest(np.eye(3), 0.0, False)]
        return likely if any(_is_upright(guess) for guess in likely) else [*likely, standing[0]]

    def settle(self, rests: list[_Rest]) -> list[tuple[Settled, bool]]:
        """Set the body down in simulation in each of the poses; tell where it went, and whether it stayed.

        Staying is judged twice: set down level, and nudged, tilted by ``NUDGE_DEG`` the way it tilts most easily.
        """
        if not rests:
            return []
        level = np.array([rest.rotation for rest in rests])
        nudge_rad = np.radians(NUDGE_DEG)
        nudged = easiest_tilt(self.corners, self.body.center_of_mass_m, level, nudge_rad)[1]
        poses = [
            transform(rotation, np.array([0, 0, -float((self.corners @ rotation[2]).min())]))
            for rotation in np.concatenate([level, nudged])
        ]
        outcomes = settle_on_plane(self.body, poses, drop_m=self.settings.drop_m, seconds=self.settings.seconds)
        both = zip(outcomes[: len(rests)], outcomes[len(rests) :], strict=True)
        return [(first, self._stayed(first, 0.0) and self._stayed(second, nudge_rad)) for first, second in both]

    def _stayed(self, outcome: Settled, tilted_rad: float) -> bool:
        most_rad = np.radians(self.settings.max_turned_deg) + tilted_rad  # to fall back level is no turning over
        return bool(outcome.moved_m < self.settings.max_moved_m and outcome.turned_rad < most_rad)

    def tried(self, guesses: list[_Rest], again_if: Callable[[np.ndarray], bool]) -> list[_Rest]:
        """Set the body down in each pose and say where it stays; where ``again_if``, again from where it fell to."""
        rests: list[_Rest] = []
        fallen: list[_Rest] = []
        for guess, (outcome, stayed) in zip(guesses, self.settle(guesses), strict=True):
            found = replace(guess, rotation=self.resting(guess, outcome), settled=stayed)
            if stayed:
                _add(rests, found)
            elif outcome.at_rest and again_if(found.rotation):
                fallen.append(found)
            else:
                rests.append(guess)
        fallen = [found for found in fallen if not _joined(rests, found)]
        for found, (_, stayed) in zip(fallen, self.settle(fallen), strict=True):
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
    return bool(rest.up @ UP > np.cos(np.radians(UPRIGHT_DEG)))


def _placement(rest: _Rest, outline: np.ndarray, hull_points: np.ndarray) -> dict[str, Any]:
    """Return a twin.Placement: the plane frame's origin is the centre of the circle around the projection."""
    center, radius = smallest_enclosing_circle((outline @ rest.rotation.T)[:, :2])
    height = -float((hull_points @ rest.up).min())
    return {
        "position_m": [-float(center[0]), -float(center[1]), height],
        "quaternion_wxyz": quaternion_wxyz(rest.rotation).tolist(),
        "probability": rest.probability,
        "upright": bool(_is_upright(rest)),
        "settled": bool(rest.settled),
        "collision_radius_m": radius,
    }
