"""Renderer of an environment's state, with the same pictures as recorded episodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manitwin.episodes.cameras import named_cameras
from manitwin.episodes.replay_pictures import EpisodeReplay, twin_drawable
from manitwin.episodes.tasks.task_setting import TaskSetting
from manitwin.physics.sapien.robot import SapienRobot
from manitwin.physics.sapien.world import RobotWorld
from manitwin.render.device import require_renderer
from manitwin.robots.robot import Robot
from manitwin.scenes.furniture_pictures import render_lighting
from manitwin.twin.loaded_twin import TwinSource


class WorldRenderer:
    """Renders the world of a task from named cameras. Raises RendererMissing, and UsageError for an unknown camera."""

    def __init__(self, setting: TaskSetting, source: TwinSource, robot: Robot, cameras: Sequence[str], size_px: int):
        """Upload meshes and textures of the scene."""
        self._cameras, self._size_px = named_cameras(cameras, robot), size_px
        require_renderer()
        record = setting.scene.scene.record
        self._replay = EpisodeReplay(
            robot,
            [twin_drawable(source.folder(each.twin_id), size_px) for each in setting.scene.objects],
            furniture=record.furniture,
            fixtures=setting.problem.fixtures,
            lighting=render_lighting(record.ambient, record.lights),
            picture_px=size_px,
        )

    def paint(self, world: RobotWorld) -> dict[str, np.ndarray]:
        """Return the pictures ``(size, size, 3) uint8`` by camera name."""
        poses = [world.object_to_world(number) for number in range(len(world.placed))]
        pictures = self._replay.picture(
            poses,
            np.concatenate([arm.joint_positions() for arm in world.robots]),
            np.concatenate([_hand_of(arm) for arm in world.robots]),
            self._cameras,
            size_px=self._size_px,
        )
        return {camera.name: picture for camera, picture in zip(self._cameras, pictures, strict=True)}

    def close(self) -> None:
        """Release the driver's resources."""
        self._replay.close()


def _hand_of(arm: SapienRobot) -> np.ndarray:
    """Return a hand's state ``(h,)`` as in recordings."""
    return np.array([arm.opening_m()]) if arm.robot.has_jaws else arm.hand_positions()
