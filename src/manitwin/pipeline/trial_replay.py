"""Replay of a grasp trial as it was made for a twin, with a recording for display."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib import import_module
from typing import cast

import numpy as np
import trimesh
from pydantic import ValidationError

from manitwin.config import VerifyConfig
from manitwin.errors import UsageError
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.geometry.ray_caster import RayCaster
from manitwin.physics.trial import TrialSettings
from manitwin.physics.trial_recording import RecordingTrial, TrialRecording
from manitwin.pipeline.verify import trial_settings
from manitwin.robots.grippers.gripper import Gripper, load_gripper, shipped_grippers
from manitwin.twin.grasp_summary import GraspSummary, Trial
from manitwin.twin.grasp_table import JOINTS
from manitwin.twin.loaded_twin import Twin

ENGINES = {
    ("parallel", "sapien"): "manitwin.physics.sapien.trial:SapienTrial",
    ("parallel", "mujoco"): "manitwin.physics.mujoco.trial:MujocoTrial",
    ("suction", "statics"): "manitwin.physics.suction_trial:SuctionTrial",
    ("multi_finger", "sapien"): "manitwin.physics.sapien.fingers:ArticulatedTrial",
}
"""Trial classes by kind of gripper and engine, imported on demand."""


@dataclass(frozen=True)
class ReplayedTrial:
    """A replayed trial: the pose ``gripper_to_object (4, 4)``, gripper and engine, and the outcome in the twin's record."""

    recording: TrialRecording
    gripper: Gripper
    gripper_to_object: np.ndarray
    engine: str
    recorded_outcome: str


def replay_trial(twin: Twin, gripper_name: str, grasp_id: str) -> ReplayedTrial:
    """Repeat the trial of one grasp of a twin with the settings, mass and friction of its record.

    A grasp that holds in the first engine but failed in the record is repeated in the confirming engine. Hulls and poses are
    read from rounded files, so that a marginal grasp may end differently. Raises UsageError if there is no such grasp, or if
    its gripper or engine does not come with the package.
    """
    summary, gripper = summary_of(twin, gripper_name), known_gripper(twin, gripper_name)
    engine, confirmed_by = summary.trial.engine, summary.trial.confirmed_by
    trial = _recording_trial(gripper, engine)
    pose, joints_rad, outcome = _grasp(twin, gripper_name, grasp_id)
    body = twin.rigid_body()
    if gripper.kind == "suction":  # a suction cup depends on details that hulls smooth out
        body = replace(body, surface=_surface(twin))
    settings = settings_of_trial(twin, summary.trial, gripper)
    recording = trial.record(body, gripper, pose, settings, joints_rad)
    if outcome != "held" and recording.result.outcome == "held" and confirmed_by is not None:
        engine = confirmed_by
        recording = _recording_trial(gripper, engine).record(body, gripper, pose, settings, joints_rad)
    return ReplayedTrial(recording, gripper, pose, engine, outcome)


def _recording_trial(gripper: Gripper, engine: str) -> RecordingTrial:
    where = ENGINES.get((gripper.kind, engine))
    if where is None:
        known = ", ".join(f"{each} with {kind}" for kind, each in sorted(ENGINES))
        raise UsageError(
            f"trials of the engine {engine} with a {gripper.kind} gripper cannot be recorded; valid: {known}"
        )
    module, name = where.split(":")
    return cast(RecordingTrial, getattr(import_module(module), name)())


def summary_of(twin: Twin, gripper_name: str) -> GraspSummary:
    """Return the grasp summary of a gripper in a twin's record. Raises UsageError if there is none."""
    first = twin.record.grasps
    if first is not None and first.gripper == gripper_name:
        return first
    other = first.other_grippers.get(gripper_name) if first is not None else None
    if other is None or other.summary is None:
        raise UsageError(
            f"{twin.record.twin_id}: has no grasps for a gripper of this name; its record lists its grippers"
        )
    return other.summary


def known_gripper(twin: Twin, gripper_name: str) -> Gripper:
    """Return a gripper of the package that matches the twin's record. Raises UsageError for another one."""
    if gripper_name not in shipped_grippers():
        raise UsageError(
            "this gripper is not shipped with the package, and a twin stores only its name; no trial can be replayed"
        )
    gripper = load_gripper(gripper_name)
    if gripper.sha256 != summary_of(twin, gripper_name).gripper_sha256:
        raise UsageError(f"the {gripper_name} of this package differs from the one of the trial; build the twin again")
    return gripper


def settings_of_trial(twin: Twin, trial: Trial, gripper: Gripper) -> TrialSettings:
    """Return the trial settings in a record. Raises UsageError if they are invalid."""
    known = trial.model_dump()
    try:
        asked = VerifyConfig(**{name: known[name] for name in VerifyConfig.model_fields if name in known})
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise UsageError(
            f"{twin.folder}: its grasp trials cannot be repeated (grasps.trial.{where}: {first['msg']}); build it again"
        ) from error
    return trial_settings(asked, gripper)


def _surface(twin: Twin) -> RayCaster:
    joined = trimesh.util.concatenate(twin.visual)
    assert isinstance(joined, trimesh.Trimesh)
    return RayCaster(joined)


def _grasp(twin: Twin, gripper_name: str, grasp_id: str) -> tuple[np.ndarray, np.ndarray | None, str]:
    """Return the pose of a grasp ``(4, 4)``, the joint values ``(2, J)`` of a hand with several joints, and the outcome."""
    table = twin.grasp_table()
    names = zip(table["gripper"].to_pylist(), table["grasp_id"].to_pylist(), strict=True)
    row = next((place for place, name in enumerate(names) if name == (gripper_name, grasp_id)), None)
    if row is None:
        raise UsageError(f"{twin.record.twin_id}: has no grasp of this name; grasps.parquet lists its grasps")
    found = table.slice(row, 1).to_pylist()[0]
    rotation = rotation_from_quaternion_wxyz(np.array([found["quaternion_wxyz"]], float))[0]
    pose = transform(rotation, np.array(found["position_m"], float))
    if not np.isfinite(pose).all():
        raise UsageError(f"{twin.record.twin_id}: the pose of the grasp is not finite; build the twin again")
    joints = [found[name] for name in JOINTS]
    return pose, None if any(not each for each in joints) else np.array(joints, float), found["outcome"]
