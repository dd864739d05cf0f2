"""Drafts up to the grasp stages: a box with known points, made-up proposals and verdicts, and engines that answer as told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from manitwin.engine.stage import Draft, Stage
from manitwin.engine.stage_runner import run_stage
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.trial import TrialResult, TrialSettings
from manitwin.pipeline.item import Item
from manitwin.robots.grippers.gripper import load_gripper

PANDA = load_gripper("panda")


def estimate(value: float, low: float | None = None, high: float | None = None) -> dict[str, Any]:
    return {
        "value": value,
        "low": value if low is None else low,
        "high": value if high is None else high,
        "source": "user",
    }


def box_draft(folder: Path, extents_m: list[float], points: list[list[float]], mass_kg: float = 0.3) -> Draft:
    """A standing box; the first point is functional, the others are grasp points."""
    box = trimesh.creation.box(extents_m)
    box.apply_translation([0, 0, extents_m[2] / 2])
    np.savez(folder / "solid.npz", vertices=box.vertices, faces=box.faces)
    np.savez(folder / "hulls.npz", hull_00=box.vertices)
    np.savez(folder / "parts.npz", solid=np.full(len(box.faces), 255, np.uint8))
    x, y, z = np.square(extents_m)
    physical = {
        "mass_kg": estimate(mass_kg, 0.7 * mass_kg, 1.4 * mass_kg),
        "friction_static": estimate(0.5),
        "friction_dynamic": estimate(0.4),
        "center_of_mass_m": [0, 0, extents_m[2] / 2],
        "center_of_mass_uncertainty_m": 0.005,
        "inertia_kg_m2": (mass_kg / 12 * np.diag([y + z, x + z, x + y])).tolist(),
    }
    functional = [{"id": "f0", "position_m": points[0], "label": "top"}]
    types = ("parallel_jaw", "pinch")
    grasp = [
        {"id": f"g{number}", "position_m": point, "type": types[number % 2]} for number, point in enumerate(points[1:])
    ]
    draft = Draft("box", Item(None, "box"), seed=3)
    standing = {
        "position_m": [0, 0, 0],
        "quaternion_wxyz": [1, 0, 0, 0],
        "probability": 1.0,
        "upright": True,
        "settled": True,
    }
    draft.fields.update(
        physical=physical, points={"functional": functional, "grasp": grasp}, placements=[standing], parts=[]
    )
    draft.paths.update({name: folder / name for name in ("solid.npz", "hulls.npz", "parts.npz")})
    return draft


def run_all(draft: Draft, work: Path, *stages: Stage) -> Draft:
    """Run the stages as a build does, which checks that each writes what it declares."""
    for stage in stages:
        run_stage(stage, draft, work)
    return draft


def proposed_draft(
    folder: Path,
    outcomes: list[str],
    *,
    unfiltered: int = 0,
    suffix: str = "",
    draft: Draft | None = None,
    second_outcomes: list[str] | None = None,
) -> Draft:
    """A box draft with made-up proposals and verdicts: the last ``unfiltered`` ones are the unfiltered sample.

    Proposal i is at x = i mm and touches the box, as far as it does, beside grasp point g(i mod 2).
    """
    draft = draft or box_draft(folder, [0.04, 0.04, 0.25], [[0, 0, 0.25], [0.02, 0, 0.1], [0.02, 0, 0.2]])
    count = len(outcomes)
    names = ["maker"] * (count - unfiltered) + ["maker:unfiltered"] * unfiltered
    np.savez(
        folder / f"proposals{suffix}.npz",
        gripper_to_object=np.array([transform(np.eye(3), np.array([i / 1000, 0, 0])) for i in range(count)]).reshape(
            -1, 4, 4
        ),
        width_m=np.full(count, 0.04),
        depth_m=PANDA.tip_depth_m + 0.1 * (np.arange(count) % 2),
        score=np.linspace(1, 0.5, count),
        proposer=np.array(names, str),
    )
    np.savez(
        folder / f"verdicts{suffix}.npz",
        outcome=np.array(outcomes, "U16"),
        displacement_m=np.full(count, 0.001),
        rotation_rad=np.full(count, 0.01),
        second_outcome=np.array(second_outcomes or [""] * count, "U16"),
    )
    for name in ("proposals", "verdicts"):
        draft.paths[f"{name}{suffix}.npz"] = folder / f"{name}{suffix}.npz"
    draft.fields[f"proposals{suffix}"] = {
        "proposed": 100,
        "proposed_by_filter": {"raw": 200, "after_pad": 150, "after_collision": 100},
        "point_radius_m": 0.03,
        "association_radius_m": 0.03,
        "association_radius_widened": False,
        "share_beyond_3cm": 0.0,
    }
    draft.fields[f"trial{suffix}"] = {
        "engine": "first",
        "finger_friction": 1.0,
        "object_friction": 0.5,
        "combine": "average",
        "force_n": 50.0,
        "timestep_s": 1 / 240,
        "solver_iterations": 20,
        "max_steps": 2000,
        "stable_frames": 3,
        "max_displacement_m": 0.01,
        "slide_distance_m": 0.1,
    }
    return draft


@dataclass
class Scripted:
    """An engine that answers by the grasp's pose and counts what it was asked: stands in where only counting is tested."""

    outcome: Callable[[np.ndarray, TrialSettings], str]
    name: str = "scripted"
    asked: int = 0

    def run(
        self, body: RigidBody, gripper: Any, gripper_to_object: np.ndarray, settings: TrialSettings, **more: Any
    ) -> list[TrialResult]:
        self.asked += len(gripper_to_object)
        return [
            TrialResult(self.outcome(pose, settings), 0.002, 0.02, 0.0, (50.0, 50.0), 100) for pose in gripper_to_object
        ]


def number_of(pose: np.ndarray) -> int:
    """Which proposal of ``proposed_draft`` a pose is."""
    return round(1000 * float(pose[0, 3]))
