"""Sources of episodes and tasks: a data set of twins, scenes, or tasks in scenes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from manitwin.engine.ledger.location import CONFIG
from manitwin.episodes.tasks.task_files import TASKS
from manitwin.errors import UsageError
from manitwin.robots.grippers.twin_grippers import require_same_gripper
from manitwin.robots.robot import Robot
from manitwin.scenes.changed_twins import require_same_twins
from manitwin.scenes.scene_files import SCENES, read_scene, scene_ids, scene_name
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.record_digests import TwinState


@dataclass(frozen=True)
class EpisodesSource:
    """A data set of twins, optionally scenes with these twins, and optionally tasks in these scenes.

    ``states`` are the current states of the twins in the scenes, ``remarks`` concern these twins.
    """

    dataset: str
    scenes: str | None
    tasks: str | None = None
    states: Mapping[str, TwinState] = field(default_factory=dict, compare=False)
    remarks: tuple[str, ...] = field(default=(), compare=False)

    @classmethod
    def detect(cls, place: str | Path, twins: str | Path | None = None) -> EpisodesSource:
        """Detect the kind of source.

        ``twins`` is the current location of the scenes' twins; None: that recorded with the layouts. Raises UsageError for an
        invalid source, and for scenes whose twins are missing or have changed.
        """
        root = DatasetRoot(place)
        path = root.absolute()
        if root.exists(TASKS) and root.exists(CONFIG):
            return cls._of_tasks(root, path, twins)
        if root.exists(SCENES) and root.exists(CONFIG):
            said = root.read_json(CONFIG, UsageError, remedy="make the layouts again")
            if not isinstance(said.get("dataset"), str):
                raise UsageError(
                    f"{place}/{CONFIG}: does not name the data set of these scenes; make the layouts again"
                )
            dataset = said["dataset"] if twins is None else DatasetRoot(twins).absolute()
            return cls(dataset, path, None, *_check_twins(dataset, Path(path)))
        if twins is not None:
            raise UsageError(f"{place}: contains no scenes; --twins applies to scenes only, leave --twins out")
        return cls(path, None)

    @classmethod
    def _of_tasks(cls, root: DatasetRoot, path: str, twins: str | Path | None) -> EpisodesSource:
        said = root.read_json(CONFIG, UsageError, remedy="make the tasks again")
        dataset = said.get("dataset") if twins is None else DatasetRoot(twins).absolute()
        scenes = said.get("scenes")
        if not isinstance(dataset, str) or not isinstance(scenes, str):
            raise UsageError(f"{root.url}/{CONFIG}: does not name the scenes of its tasks; make the tasks again")
        return cls(dataset, scenes, path, *_check_twins(dataset, Path(scenes)))

    def check_grippers(self, robot: Robot) -> None:
        """Raise UsageError if twins of the scenes have grasps of a different gripper with the robot's gripper name."""
        require_same_gripper(robot.gripper, ((each, state.grippers) for each, state in self.states.items()), robot.name)


def _check_twins(dataset: str, scenes: Path) -> tuple[dict[str, TwinState], tuple[str, ...]]:
    """Return the states of the twins of scenes, and remarks.

    Raises UsageError if a twin is missing, because every batch with it would fail, or has changed since the scene was
    settled, because episodes would then start in a scene that no simulation has settled.
    """
    source, ids = TwinSource(dataset), scene_ids(scenes)
    source.check({each.twin_id for scene_id in ids for each in read_scene(scenes / scene_name(scene_id)).objects})
    read = (read_scene(scenes / scene_name(scene_id)) for scene_id in ids)
    now, remarks = require_same_twins(read, source, str(scenes))
    return {twin_id: state for twin_id, state in now.states.items() if state is not None}, tuple(remarks)
