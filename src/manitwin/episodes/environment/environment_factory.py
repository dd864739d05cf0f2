"""Construction of a task's environment from a tasks file."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial
from numbers import Integral
from pathlib import Path

from manitwin.engine.ledger.location import CONFIG
from manitwin.episodes.downsampling import rows_per_frame
from manitwin.episodes.environment.environment import TaskEnvironment
from manitwin.episodes.environment.start_noise import StartNoise
from manitwin.episodes.planning.two_arms import planner_of
from manitwin.episodes.recording import RATE_HZ
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.registry import load_skill
from manitwin.episodes.skills.robot_compatibility import check_hand
from manitwin.episodes.target_grasps import TargetGrasp, usable_grasps
from manitwin.episodes.tasks.task_files import one_task
from manitwin.episodes.tasks.task_setting import task_setting
from manitwin.errors import UsageError
from manitwin.formats.json_file import read_json_object
from manitwin.robots.load import load_robot
from manitwin.scenes.changed_twins import require_same_twins
from manitwin.scenes.layouts.pool import cached_pool
from manitwin.scenes.scene_files import read_scene, scene_name
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import TwinSource

_REMEDY = "give a folder that manitwin tasks wrote, or a file in it"


def make_env(
    tasks: str | Path,
    task_id: str | None = None,
    *,
    twins: str | Path | None = None,
    robot: str | None = None,
    cameras: Sequence[str] = (),
    picture_px: int = 128,
    max_steps: int = 1200,
    rate_hz: int = RATE_HZ,
    start_noise: StartNoise | None = None,
) -> TaskEnvironment:
    """Return a task's environment, as described in ``manitwin.make_env``; raises UsageError for missing or invalid inputs."""
    for name, number in (("max_steps", max_steps), ("picture_px", picture_px)):
        if isinstance(number, bool) or not isinstance(number, Integral) or number < 1:
            raise UsageError(f"{name} is {number!r}; give a whole number, 1 or more")
    rows_per_frame(rate_hz)
    if isinstance(cameras, str):
        raise UsageError(f"cameras is {cameras!r}; give a tuple of names: ({cameras!r},)")
    if not (start_noise is None or isinstance(start_noise, StartNoise)):
        raise UsageError(f"start_noise is {start_noise!r}; give a manitwin.StartNoise, or None")
    task = one_task(tasks, task_id)
    folder = Path(tasks) if Path(tasks).is_dir() else Path(tasks).parent
    said = read_json_object(folder / CONFIG, UsageError, inside=folder, name=str(folder / CONFIG), remedy=_REMEDY)
    if not isinstance(said.get("dataset"), str) or not isinstance(said.get("scenes"), str):
        raise UsageError(f"{folder / CONFIG}: does not name the scenes of its tasks; {_REMEDY}")
    dataset = said["dataset"] if twins is None else DatasetRoot(twins).absolute()
    settings, chosen = EpisodeSettings(), load_robot(task.robot if robot is None else robot)
    for step in task.steps:
        check_hand(chosen, load_skill(step.skill))
    source, planner = TwinSource(dataset), planner_of(chosen, settings.timestep_s)
    scene = Path(said["scenes"]) / scene_name(task.scene_id)
    require_same_twins([read_scene(scene)], source, str(scene))

    @lru_cache(maxsize=64)
    def grasps(twin_id: str) -> tuple[TargetGrasp, ...]:
        return usable_grasps(source.twin(twin_id), chosen.gripper)

    setting = task_setting(task, said["scenes"], dataset, cached_pool(dataset), chosen, grasps, seed=task.seed)
    if setting is None:
        raise UsageError(
            f"task {task.task_id}: cannot begin with the robot {chosen.name}; give the robot that the task was made for"
        )
    painter = None
    if cameras:
        from manitwin.episodes.environment.world_renderer import WorldRenderer

        painter = WorldRenderer(setting, source, chosen, cameras, picture_px)
    return TaskEnvironment(
        setting,
        chosen,
        planner,
        settings,
        max_steps=max_steps,
        rate_hz=rate_hz,
        painter=painter,
        cameras=cameras,
        picture_px=picture_px,
        start_noise=start_noise,
        made_by=partial(
            make_env,
            Path(tasks).absolute(),  # absolute, because it may be recreated in another working folder
            task.task_id,
            twins=None if twins is None else dataset,
            robot=str(Path(robot).absolute()) if robot is not None and robot.endswith(".toml") else robot,
            cameras=tuple(cameras),
            picture_px=picture_px,
            max_steps=max_steps,
            rate_hz=rate_hz,
            start_noise=start_noise,
        ),
    )
