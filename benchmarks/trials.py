"""Measure the grasp trials of finished twins: their cost, where the time is spent, and the accuracy of cheap verdicts.

    python benchmarks/trials.py TWINS [--grasps N] [--reference N] [--processes N]

``TWINS`` is a folder of finished twins. All ratios are of CPU seconds measured in the same run:

- against one scene per grasp with all hulls, all slides and no early exit;
- against the time inside the physics steps alone;
- with ``--reference N``, that many jittered and plain grasps of each twin are tried at 1/960 s and 40 iterations and the verdicts
  are compared, as are those of the reference itself with the hand moved by 20 um;
- ``--processes`` runs the same trials in several processes and compares the wall seconds with those of one.
"""

from __future__ import annotations

import argparse
import multiprocessing
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics import trial_phases
from manitwin.physics.robustness import jittered
from manitwin.physics.sapien import hand_scene
from manitwin.physics.sapien import trial as sapien_trial
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.physics.trial import TrialSettings
from manitwin.pipeline.second_opinion import cohens_kappa
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.twin.loaded_twin import Twin

REFERENCE = {"timestep_s": 1 / 960, "solver_iterations": 40, "steps_per_frame": 16, "max_steps": 8000}
BESIDE_M = 2e-5
NO_LIMITS = {
    "max_overlap_m": np.inf,
    "max_penetration_m": np.inf,
    "min_finger_force_n": -1.0,
    "max_lift_displacement_m": np.inf,
    "max_displacement_m": np.inf,
    "stable_speed_m_s": np.inf,
    "doubts_tried_again": False,
}


def main() -> None:
    """Run all twins and print a line for each, then the medians."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("twins", type=Path)
    parser.add_argument("--grasps", type=int, default=100)
    parser.add_argument("--reference", type=int, default=0)
    parser.add_argument("--processes", type=int, default=0)
    arguments = parser.parse_args()
    folders = sorted(path.parent for path in arguments.twins.glob("twins/*/*/grasps.parquet"))
    _one((folders[0], 2))  # imports and first calls are not measured
    rows = [_measure(folder, arguments.grasps) for folder in folders]
    for name in ("cpu_s", "around_s", "of_steps", "of_plain"):
        values = [row[name] for row in rows]
        print(f"{name}: median {np.median(values):.2f}, 90th percentile {np.percentile(values, 90):.2f}")
    if arguments.reference:
        _compare(folders, arguments.reference)
    if arguments.processes:
        _scale(folders, arguments.grasps, arguments.processes)


def _measure(folder: Path, count: int) -> dict[str, float]:
    """Return CPU seconds for 100 grasps, those outside the steps, and the ratios to steps alone and to plain trials.

    The machine's speed varies over time, so the three are measured in alternation, grasp by grasp. Reading a clock at every step
    slows down the code around the steps, so the total is that of a run without it.
    """
    twin = Twin(folder)
    body, poses = twin.rigid_body(), twin.grasps(verified_only=False).gripper_to_object[:count]
    as_run, with_clock = SapienTrial(), SapienTrial()
    total = steps = plain = 0.0
    reading_s = _cost_of_reading_the_clock()
    for pose in poses:
        total += _cpu_of_trials(as_run, body, pose[None], _settings())
        with _timed_steps() as spent:
            _cpu_of_trials(with_clock, body, pose[None], _settings())
        steps += spent[0] - spent[1] * reading_s  # each measurement includes one clock reading
        with _plain_trials():
            plain += _cpu_of_trials(SapienTrial(), body, pose[None], replace(_settings(), **NO_LIMITS))
    scale = 100 / len(poses)
    row = {
        "cpu_s": total * scale,
        "around_s": (total - steps) * scale,
        "of_steps": total / steps,
        "of_plain": total / plain,
    }
    print(f"{twin.record.name or folder.name:16s}", " ".join(f"{k} {v:.2f}" for k, v in row.items()), flush=True)
    return row


def _cost_of_reading_the_clock(times: int = 100_000) -> float:
    started = time.process_time()
    for _ in range(times):
        time.process_time()
    return (time.process_time() - started) / times


def _settings() -> TrialSettings:
    gripper = load_gripper("panda")
    return TrialSettings(force_n=gripper.force_n, finger_friction=gripper.finger_friction)


def _cpu_of_trials(trial: SapienTrial, body: RigidBody, poses: np.ndarray, settings: TrialSettings) -> float:
    gripper = load_gripper("panda")
    started = time.process_time()
    trial.run(body, gripper, poses, settings)
    return time.process_time() - started


@contextmanager
def _timed_steps() -> Iterator[list[float]]:
    """Yield a list of the CPU seconds inside the physics steps, and the number of steps."""
    spent, plain = [0.0, 0.0], hand_scene.HandScene.advance

    class Timed:
        def __init__(self, system: Any):
            self.system = system

        def step(self) -> None:
            started = time.process_time()
            self.system.step()
            spent[0] += time.process_time() - started
            spent[1] += 1

    def advance(self: hand_scene.HandScene, loads_m_s2: np.ndarray) -> None:
        system, self.system = self.system, Timed(self.system)  # type: ignore[assignment]
        try:
            plain(self, loads_m_s2)
        finally:
            self.system = system

    hand_scene.HandScene.advance = advance  # type: ignore[method-assign]
    try:
        yield spent
    finally:
        hand_scene.HandScene.advance = plain  # type: ignore[method-assign]


@contextmanager
def _plain_trials() -> Iterator[None]:
    """Keep all hulls, close for the full time, lift all the way and repeat all slides."""
    margin, share, rest = sapien_trial.REACH_MARGIN_M, trial_phases.SURE_SHARE, trial_phases.CLOSED_SPEED_M_S
    sapien_trial.REACH_MARGIN_M, trial_phases.SURE_SHARE, trial_phases.CLOSED_SPEED_M_S = 10.0, 0.0, 0.0
    brief = trial_phases.REST_M, trial_phases.TURNED_RAD
    trial_phases.REST_M = trial_phases.TURNED_RAD = 0.0
    try:
        yield
    finally:
        sapien_trial.REACH_MARGIN_M, trial_phases.SURE_SHARE, trial_phases.CLOSED_SPEED_M_S = margin, share, rest
        trial_phases.REST_M, trial_phases.TURNED_RAD = brief


def _compare(folders: list[Path], count: int) -> None:
    """Print how often the verdicts agree with the reference: for plain trials at the current step, and for trials as they are
    run.
    """
    verdicts: dict[str, list[bool]] = {"reference": [], "reference, 20 um beside": [], "plain": [], "as run": []}
    is_jittered: list[bool] = []
    for folder in folders:
        twin, rng = Twin(folder), np.random.default_rng(0)
        grasps, gripper = twin.grasps(verified_only=False), load_gripper("panda")
        index = rng.choice(len(grasps), min(count, len(grasps)), replace=False)
        poses = grasps.gripper_to_object[index]
        moved = jittered(poses, grasps.depth_m[index], rng, sigma_deg=10.0, sigma_m=0.006)
        is_jittered += [False] * len(poses) + [True] * len(moved)
        poses, body = np.concatenate([poses, moved]), twin.rigid_body()
        with _plain_trials():
            fine = replace(_settings(), **REFERENCE)  # type: ignore[arg-type]
            reference = SapienTrial().run(body, gripper, poses, fine)
            beside = poses.copy()
            beside[:, :3, 3] += rng.normal(0, BESIDE_M, (len(poses), 3))
            near = SapienTrial().run(body, gripper, beside, fine)
            plain = SapienTrial().run(body, gripper, poses, replace(_settings(), doubts_tried_again=False))
        as_run = SapienTrial().run(body, gripper, poses, _settings())
        for name, results in zip(verdicts, (reference, near, plain, as_run), strict=True):
            verdicts[name] += [result.outcome == "held" for result in results]
    truth, jitter = np.array(verdicts["reference"]), np.array(is_jittered)
    firm = np.array(verdicts["reference, 20 um beside"]) == truth
    for name in list(verdicts)[1:]:
        for kind, some in (("proposed", ~jitter), ("jittered", jitter)):
            said, true = np.array(verdicts[name])[some], truth[some]
            print(
                f"{name}, {kind}: {100 * (said == true).mean():.1f} % of {len(true)} verdicts are the reference's (of which"
                f" {true.sum()} held; {(said & ~true).sum()} held here alone), kappa {cohens_kappa(said, true) or 0.0:.2f};"
                f" {100 * (said == true)[firm[some]].mean():.1f} % of the {firm[some].sum()} in which it agrees with itself"
            )


def _one(job: tuple[Path, int]) -> float:
    folder, count = job
    twin = Twin(folder)
    poses = twin.grasps(verified_only=False).gripper_to_object[:count]
    return _cpu_of_trials(SapienTrial(), twin.rigid_body(), poses, _settings())


def _scale(folders: list[Path], count: int, processes: int) -> None:
    """Print the speed-up by several processes: wall seconds of the same trials, one object per job."""
    jobs, wall = [(folder, count) for folder in folders], {}
    context = multiprocessing.get_context("spawn")
    for number in (1, processes):
        with context.Pool(number) as pool:
            pool.map(_one, [(folders[0], 1)] * number, chunksize=1)  # imports are not measured
            started = time.perf_counter()
            pool.map(_one, jobs, chunksize=1)
            wall[number] = time.perf_counter() - started
    print(f"{processes} processes: {wall[1] / wall[processes]:.2f} times as fast as one ({wall[1]:.1f} s)")


if __name__ == "__main__":
    main()
