"""Try the verified grasps of finished twins in the second engine, and print for each object how many hold there too.

    python benchmarks/second_opinion.py DATASET [--grasps N] [--reference]

``--grasps`` takes that many of each twin, drawn at random. With ``--reference`` grasps that fail in the second engine are also
tried in the first one at 1/960 s and 40 iterations, to see which of the two is nearer to a finer solution.
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from manitwin.physics.mujoco.trial import MujocoTrial
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.physics.trial import TrialSettings
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.twin.loaded_twin import Twin

PANDA = load_gripper("panda")
SETTINGS = TrialSettings(force_n=PANDA.force_n, finger_friction=PANDA.finger_friction)
REFERENCE = replace(SETTINGS, timestep_s=1 / 960, solver_iterations=40, steps_per_frame=16, max_steps=8000)


def main() -> None:
    """Print a line per object, then the sum and the worst object."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--grasps", type=int, default=1000)
    parser.add_argument("--reference", action="store_true")
    arguments = parser.parse_args()
    folders = sorted(path.parent for path in arguments.dataset.glob("twins/*/*/grasps.parquet"))
    rows = [again(folder, arguments.grasps, arguments.reference) for folder in folders]
    held, tried = (sum(row[place] for row in rows) for place in (0, 1))
    worst = min(row[0] / row[1] for row in rows)
    below = sum(row[0] < 0.92 * row[1] for row in rows)
    print(f"{held} of {tried} hold ({100 * held / tried:.1f} %) over {len(rows)} objects; worst {100 * worst:.0f} %")
    print(f"{below} objects below 92 %")


def again(folder: Path, count: int, reference: bool) -> tuple[int, int]:
    """Try the verified grasps of one twin; return how many hold, and how many were tried."""
    twin = Twin(folder)
    body, poses = twin.rigid_body(), twin.grasps().gripper_to_object
    poses = poses[np.sort(np.random.default_rng(0).permutation(len(poses))[:count])]
    outcomes = [result.outcome for result in MujocoTrial().run(body, PANDA, poses, SETTINGS)]
    counted = Counter(outcomes)
    said = f"{twin.record.name or folder.name:20s} {1000 * body.mass_kg:6.0f} g  {counted['held']} of {len(poses)} hold"
    refused = np.flatnonzero([outcome != "held" for outcome in outcomes])
    if len(refused):
        said += f"; {', '.join(f'{n} {outcome}' for outcome, n in sorted(counted.items()) if outcome != 'held')}"
    if len(refused) and reference:
        finer = SapienTrial().run(body, PANDA, poses[refused], REFERENCE)
        said += f"; the reference holds {sum(result.outcome == 'held' for result in finer)} of these"
    print(said, flush=True)
    return counted["held"], len(poses)


if __name__ == "__main__":
    main()
