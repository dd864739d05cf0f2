"""Located objects in a depth view: their grasps, which of these a robot reaches, and the view as a layout."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from manitwin.errors import UsageError
from manitwin.geometry.poses import transform_points
from manitwin.robots.grippers.gripper import Gripper
from manitwin.scenes.locate.depth_view import DepthView, measured_noise_m
from manitwin.scenes.locate.layout_files import NoLayout
from manitwin.scenes.locate.located_furniture import located_furniture
from manitwin.scenes.locate.located_objects import LocatedObject, located_objects
from manitwin.scenes.locate.located_scene import LocatedScene, located_scene
from manitwin.scenes.locate.proposals import Plane, table_plane
from manitwin.scenes.locate.recognition import ViewedObject
from manitwin.scenes.locate.transferred_frames import TransferredPlacement, transfer_placements
from manitwin.scenes.locate.transferred_grasps import TransferredGrasps, transfer_grasps
from manitwin.scenes.locate.world_frame import WorldFrame, base_world_frame, table_world_frame
from manitwin.scenes.scene import Furniture
from manitwin.twin.loaded_twin import Twin

if TYPE_CHECKING:  # planning needs manitwin[robots]; locating does not
    from manitwin.episodes.planning.pick_place import PickPlacePlanner


class LocatedView:
    """A view with the objects located in it; results that all of them share are computed once.

    ``camera_to_base (4, 4)`` is the camera's pose in the robot's base frame, if known; ``robot`` is the arm at that base;
    ``grippers`` are custom grippers of the twins. Raises UsageError for a robot that cannot use these grasps, Unavailable if
    planning is not installed.
    """

    def __init__(
        self,
        view: DepthView,
        things: Sequence[tuple[ViewedObject, Twin]],
        camera_to_base: np.ndarray | None = None,
        robot: str | None = None,
        seed: int = 0,
        grippers: Sequence[Gripper] = (),
    ):
        self.view, self.things, self.seed = view, tuple(things), seed
        self._grippers = grippers
        self._camera_to_base = camera_to_base
        self._planner = None if robot is None else _planner_of(robot)

    @cached_property
    def plane(self) -> Plane:
        """The table plane, found without the objects' masks; raises UsageError if none is seen.

        The masks are excluded because the side of a large box could be taken for the table.
        """
        things = np.any([thing.mask for thing, _ in self.things], axis=0)
        beside = replace(self.view, depth_m=np.where(things, 0.0, self.view.depth_m))
        return table_plane(beside, np.random.default_rng(self.seed))

    @cached_property
    def world(self) -> WorldFrame:
        """The robot's world frame, or one above the table; raises UsageError if the table is tilted in the base frame."""
        middles = [
            transform_points(thing.location.poses[0].object_to_camera, thing.model.center[None])[0]
            for thing, _ in self.things
            if thing.location.poses
        ]
        about = np.mean(middles, axis=0)
        if self._camera_to_base is None:
            return table_world_frame(self.plane, about)
        return base_world_frame(self._camera_to_base, self.plane, about)

    def grasps(self, number: int) -> TransferredGrasps | None:
        """Return the collision-free grasps of an object where it was located, with a robot also their reachability.

        None if it was not located, or if its twin has no grasps for jaws. Raises UsageError if no table is seen.
        """
        thing, twin = self.things[number]
        try:
            plane = self.plane
        except UsageError as error:
            raise UsageError(f"--grasps: {error} (the hand has to keep clear of the table)") from error
        noise_m = measured_noise_m(self.view, np.ones(self.view.depth_m.shape, bool))
        carried = transfer_grasps(thing, twin, self.view, plane, noise_m, self._grippers)
        if carried is None or self._planner is None:
            return carried
        from manitwin.episodes.located_reach import with_reach

        place = sum(bool(each.location.poses) for each, _ in self.things[:number])
        return with_reach(carried, place, self._objects, self._furniture, self.world, self._planner)

    def placements(self, number: int) -> tuple[TransferredPlacement, ...]:
        """Return the resting poses of an object on the table, where it was located."""
        thing, twin = self.things[number]
        noise_m = measured_noise_m(self.view, np.ones(self.view.depth_m.shape, bool))
        return transfer_placements(thing, twin, self.view, self.plane, noise_m)

    @cached_property
    def scene(self) -> LocatedScene | NoLayout:
        """The view as a layout; at least one object was located."""
        try:
            self.plane  # noqa: B018  (that there is a table is asked first)
        except UsageError as error:
            return NoLayout(str(error))
        robot = None if self._planner is None else self._planner.robot.name
        return located_scene(self.view, self.things, self.world, robot, self.seed)

    @cached_property
    def _objects(self) -> tuple[LocatedObject, ...]:
        return located_objects(self.things, self.world)

    @cached_property
    def _furniture(self) -> Furniture:
        return located_furniture(self.view, self._objects, self.world)[0]


def _planner_of(robot: str) -> PickPlacePlanner:
    """Return the planner of a robot; raises UsageError for one without jaws, Unavailable if planning is not installed."""
    from manitwin.episodes.planning.pick_place import PickPlacePlanner
    from manitwin.episodes.skills.robot_compatibility import check_jaws
    from manitwin.robots.load import load_robot

    loaded = load_robot(robot)
    check_jaws(loaded, "grasps that are carried over")
    return PickPlacePlanner(loaded)
