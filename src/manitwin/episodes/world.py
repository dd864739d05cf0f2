"""The physics of one episode in SAPIEN: the robot, the target, the other objects and the furniture.

Weight acts as SAPIEN has it: the drive that ``physics.sapien.scene`` replaces it with gains nothing here (42 episodes with
heavy things turned by 5.0 degrees in the hand with it and by 3.4 without, at 50 solver iterations).
"""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType

import numpy as np
import sapien
from sapien import physx

from manitwin.episodes.contacts import ContactReader, Role
from manitwin.episodes.planning.problem import PickPlaceProblem
from manitwin.geometry.placed_object import PlacedObject, StaticBox
from manitwin.physics.sapien.body import dynamic_component
from manitwin.physics.sapien.hand import MIN_PATCH_RADIUS_M, PATCH_RADIUS_M
from manitwin.physics.sapien.physx_system import system_with_gravity
from manitwin.physics.sapien.robot import SapienRobot
from manitwin.physics.sapien.scene import MAX_DEPENETRATION_M_S
from manitwin.physics.sapien.shape_pool import ShapePool
from manitwin.robots.robot import Robot
from manitwin.scenes.app_config import EpisodeSettings

STILL_M_S, STILL_RAD_S = 2e-3, 2e-2
ANGULAR_DAMPING_PER_S = 0.05
LEAST_TABLE_M = 0.3
_PLANE_TO_WORLD = np.array([[0.0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]])  # PhysX's planes face +X


class EpisodeWorld:
    """One problem's scene; its objects are in the order of their names, the target at ``target``.

    To be used in a ``with`` statement: at its end the cooked shapes go back to the pool, and nothing of it may be used.
    """

    def __init__(
        self,
        robot: Robot,
        problem: PickPlaceProblem,
        settings: EpisodeSettings,
        pool: ShapePool,
        closing_force_n: float,
    ):
        """Put everything where the problem says, the robot at its home with the hand open."""
        self._settings, self._pool = settings, pool
        self.placed = sorted((problem.target, *problem.obstacles), key=lambda placed: placed.name)
        self.target = self.placed.index(problem.target)
        self._system = system_with_gravity(settings.timestep_s)
        self._scene = sapien.Scene([self._system])
        surfaces = [self._add_box(box) for box in problem.static_boxes]
        self._shapes = [pool.take(placed.body.hulls) for placed in self.placed]
        self.bodies = [
            self._add_object(placed, shapes) for placed, shapes in zip(self.placed, self._shapes, strict=True)
        ]
        self.robot = SapienRobot(
            self._scene, robot, finger_force_n=closing_force_n, contact_offset_m=settings.contact_offset_m
        )
        self.expect_load(False)
        self.contacts = ContactReader(
            self._system, self._roles(robot, problem.static_boxes, surfaces), settings.max_contact_force_n
        )

    def __enter__(self) -> EpisodeWorld:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        del self.contacts, self.robot, self.bodies, self._scene, self._system
        for placed, shapes in zip(self.placed, self._shapes, strict=True):
            self._pool.give_back(placed.body.hulls, shapes)

    def step(self, count: int = 1) -> None:
        """Let ``count`` timesteps pass."""
        step = self._system.step
        for _ in range(count):
            step()

    def expect_load(self, held: bool) -> None:
        """Choose the solver's iterations for a hand that holds something, or is empty."""
        settings = self._settings
        iterations = settings.solver_iterations_held if held else settings.solver_iterations
        self.robot.articulation.set_solver_position_iterations(iterations)
        self.bodies[self.target].solver_position_iterations = iterations

    def object_to_world(self, number: int) -> np.ndarray:
        """Return the pose ``(4, 4)`` of an object's frame."""
        return self.bodies[number].entity_pose.to_transformation_matrix().astype(float)

    def is_still(self) -> bool:
        """Tell whether no object moves."""
        return all(
            body.is_sleeping
            or (
                np.linalg.norm(body.linear_velocity) < STILL_M_S and np.linalg.norm(body.angular_velocity) < STILL_RAD_S
            )
            for body in self.bodies
        )

    def _add_box(self, box: StaticBox) -> physx.PhysxRigidStaticComponent:
        friction = self._settings.furniture_friction
        material = physx.PhysxMaterial(friction, friction, 0.0)
        component = physx.PhysxRigidStaticComponent()
        if _is_the_table(box):
            shape, pose = physx.PhysxCollisionShapePlane(material), _PLANE_TO_WORLD
        else:
            shape = physx.PhysxCollisionShapeBox(box.half_extents_m.astype(np.float32), material)
            pose = box.box_to_world
        shape.contact_offset = self._settings.contact_offset_m
        component.attach(shape)
        self._add(component, pose)
        return component

    def _add_object(
        self, placed: PlacedObject, shapes: list[physx.PhysxCollisionShapeConvexMesh]
    ) -> physx.PhysxRigidDynamicComponent:
        component = dynamic_component(placed.body, shapes, contact_offset_m=self._settings.contact_offset_m)
        for shape in shapes:
            shape.patch_radius, shape.min_patch_radius = PATCH_RADIUS_M, MIN_PATCH_RADIUS_M
        component.solver_position_iterations = self._settings.solver_iterations
        component.solver_velocity_iterations = 1
        component.max_depenetration_velocity = MAX_DEPENETRATION_M_S
        component.set_linear_damping(0.0)
        component.set_angular_damping(ANGULAR_DAMPING_PER_S)
        self._add(component, placed.object_to_world)
        return component

    def _add(self, component: physx.PhysxRigidBaseComponent, pose: np.ndarray) -> None:
        entity = sapien.Entity()
        entity.add_component(component)
        entity.pose = sapien.Pose(pose)
        self._scene.add_entity(entity)

    def _roles(
        self, robot: Robot, boxes: Sequence[StaticBox], surfaces: Sequence[physx.PhysxRigidStaticComponent]
    ) -> list[tuple[physx.PhysxBaseComponent, str, Role]]:
        """Name every body and say what it is; the robot's base does not move and touches nothing by accident."""
        roles = [(surface, box.name, Role.FURNITURE) for surface, box in zip(surfaces, boxes, strict=True)]
        for number, (body, placed) in enumerate(zip(self.bodies, self.placed, strict=True)):
            roles.append((body, placed.name, Role.TARGET if number == self.target else Role.OTHER))
        fingers = dict(zip(robot.finger_links, (Role.PLUS_FINGER, Role.MINUS_FINGER), strict=True))
        for name, link in self.robot.links.items():
            hand = Role.HAND if name in robot.hand_links else Role.ARM
            roles.append((link, name, fingers.get(name, hand)))
        return roles


def _is_the_table(box: StaticBox) -> bool:
    """Tell whether a box's top is the plane that the robot stands on, and so large that nothing is to go beside it.

    It is a plane in physics: between PhysX's boxes and hulls contacts persist from step to step, and a tall box that is set
    down rocks by a degree or two for ever. Of six boxes of cereals let go with up to 3 degrees of tilt, one had come to rest
    after 3 s on a box, and all on a plane.
    """
    top = box.box_to_world[:3, 2] * box.half_extents_m[2] + box.box_to_world[:3, 3]
    return bool(
        box.box_to_world[2, 2] > 1 - 1e-9 and abs(top[2]) < 1e-6 and box.half_extents_m[:2].min() >= LEAST_TABLE_M
    )
