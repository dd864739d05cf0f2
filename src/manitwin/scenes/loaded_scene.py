"""Scene in memory: its record and its twins."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.geometry.rigid_body import PlacedObject, RigidBody, StaticBox
from manitwin.scenes.changed_twins import CurrentTwinStates, find_changed_twins
from manitwin.scenes.scene import Furniture, SceneObject, SceneRecord
from manitwin.scenes.scene_files import read_scene
from manitwin.twin.loaded_twin import Twin, TwinSource

if TYPE_CHECKING:
    import mujoco

    from manitwin.scenes.sapien_scene import SapienEntities


class Scene:
    """A layout of twins in the world frame, metres, +Z up; twins are read on demand."""

    def __init__(self, record: SceneRecord, twins: TwinSource):
        """Create a scene from a record and the data set of its twins."""
        self.record = record
        self._source = twins
        self._twins: dict[str, Twin] = {}
        self._bodies: dict[str, RigidBody] = {}

    @classmethod
    def read(cls, scene: str | Path, dataset: str | Path) -> Scene:
        """Read a scene's file or folder; ``dataset`` is the data set it was sampled from. Raises UsageError."""
        return cls(read_scene(Path(scene)), TwinSource(dataset))

    def __repr__(self) -> str:
        return f"Scene({self.record.scene_id}, {len(self.record.objects)} objects on a {self.record.furniture.kind})"

    def twin(self, twin_id: str) -> Twin:
        """Return one of the scene's twins; raises UsageError if it is not in the data set."""
        if twin_id not in self._twins:
            self._twins[twin_id] = self._source.twin(twin_id)
        return self._twins[twin_id]

    def body(self, twin_id: str) -> RigidBody:
        """Return the rigid body of one of the scene's twins."""
        if twin_id not in self._bodies:
            self._bodies[twin_id] = self.twin(twin_id).rigid_body()
        return self._bodies[twin_id]

    @property
    def stale(self) -> str | None:
        """A line on twins that were rebuilt and rest differently now than in the scene; None if there are none."""
        return find_changed_twins([self.record], CurrentTwinStates(self._source)).changed_remark

    def placed_objects(self) -> list[PlacedObject]:
        """Return the objects with their bodies, in the record's order; raises UsageError for a missing twin."""
        return [
            PlacedObject(each.name, each.twin_id, self.body(each.twin_id), object_pose(each))
            for each in self.record.objects
        ]

    def static_boxes(self) -> list[StaticBox]:
        """Return the boxes of the furniture."""
        return furniture_boxes(self.record.furniture)

    def add_to_sapien(self, scene: Any, *, visual: bool = True) -> SapienEntities:
        """Add objects and furniture to a SAPIEN 3 scene, with ``visual`` also render shapes and lights; return them by name.

        ``visual`` requires a render system.
        """
        from manitwin.scenes.sapien_scene import add_to_sapien

        return add_to_sapien(scene, self.record, self.static_boxes(), self.placed_objects(), self.twin, visual=visual)

    def to_mujoco(self) -> mujoco.MjModel:
        """Return a MuJoCo model in which objects are free bodies with their names; ``qpos0`` is the recorded scene."""
        from manitwin.scenes.mujoco_scene import to_mujoco

        return to_mujoco(self.static_boxes(), self.placed_objects())


def object_pose(placed: SceneObject) -> np.ndarray:
    """Return the recorded ``object_to_world (4, 4)``."""
    return transform(rotation_from_quaternion_wxyz(np.array(placed.quaternion_wxyz)), np.array(placed.position_m))


def furniture_boxes(furniture: Furniture) -> list[StaticBox]:
    """Return the boxes of a piece of furniture."""
    return [
        StaticBox(each.name, np.array(each.half_extents_m), transform(translation=np.array(each.center_m)))
        for each in furniture.boxes
    ]
