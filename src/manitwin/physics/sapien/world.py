"""Robot world in SAPIEN: a robot, the target, the other objects, furniture and fixtures.

Gravity acts as SAPIEN applies it. The load drive that ``hand_scene`` uses instead gains nothing here: in 42 episodes with
heavy objects, these turned by 5.0 degrees in the hand with it and by 3.4 without, at 50 solver iterations.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from types import TracebackType

import numpy as np
import sapien
from sapien import physx

from manitwin.geometry.rigid_body import FURNITURE_FRICTION, PlacedObject, RigidBody, StaticBox, is_plane_equivalent
from manitwin.physics.sapien.body import entity_at, graspable_component, iterations_beside, static_box, static_plane
from manitwin.physics.sapien.contacts import ContactReader, Role
from manitwin.physics.sapien.free_fall import FreeFallLimiter
from manitwin.physics.sapien.granules import FALL_S, GranuleFill, Granules
from manitwin.physics.sapien.robot import SapienRobot
from manitwin.physics.sapien.scene import system_with_gravity
from manitwin.physics.sapien.settle import RestLimits, RestState, RestWatch, settle
from manitwin.physics.sapien.shapes import COOKED, HullShapes
from manitwin.robots.robot import Robot

# Rest is judged by velocities, with limits twice as high as elsewhere, because it only ends a wait here; whether a start or a
# placement is stable is judged by poses. Judged by mean speeds, 50 of 50 episodes had the same outcome and rested up to 0.25
# s sooner or later.
RESTS = RestLimits(speed_m_s=2e-3, turn_rad_s=2e-2, looks=2, by_velocity=True)

SLENDER_M, SLENDER_FACTOR = 0.01, 2
"""Radius of gyration, about half a pad's width, below which a held object needs more iterations: contacts farther from its
axis than that push each other away through it as they are solved one after the other. At 24 iterations knives of 38 and 104 g
vibrated in the jaws by a degree per step and sprang out; with twice as many they are at rest.
"""


class RobotWorld:
    """A robot in a scene. Its objects are sorted by name; ``target`` is the target's index; ``granules`` are optional.

    ``robots`` are its arms, one or two; ``robot`` and ``contacts`` are those of the arm selected by ``use``. Use it in a
    ``with`` statement: at exit the cooked hulls return to the cache, and no part of it may be used any more.
    """

    def __init__(
        self,
        robot: Robot,
        target: PlacedObject,
        others: Sequence[PlacedObject] = (),
        boxes: Sequence[StaticBox] = (),
        fixtures: Sequence[StaticBox] = (),
        *,
        closing_force_n: float,
        timestep_s: float,
        contact_offset_m: float,
        solver_iterations: int,
        solver_iterations_held: int,
        max_contact_force_n: float,
        furniture_friction: float = FURNITURE_FRICTION,
    ):
        """Place everything at its pose, with the robot at home and its hand open.

        ``solver_iterations_held`` are the iterations while an object is held; a contact counts as unplanned above
        ``max_contact_force_n``.
        """
        self.timestep_s, self._contact_offset_m = timestep_s, contact_offset_m
        self._iterations, self._iterations_held = solver_iterations, solver_iterations_held
        self.placed = sorted((target, *others), key=lambda placed: placed.name)
        self.target = self.placed.index(target)
        self.set_held_objects({target.name})
        self._system = system_with_gravity(timestep_s)
        self._scene = sapien.Scene([self._system])
        standing = [*boxes, *fixtures]
        surfaces = [self._add_box(box, furniture_friction) for box in standing]
        bearing = [Role.FURNITURE] * len(boxes) + [Role.FIXTURE] * len(fixtures)
        self.granules: Granules | None = None
        self._loan = COOKED.lent([placed.body.hulls for placed in self.placed])
        counts = iterations_beside([placed.body.mass_kg for placed in self.placed], solver_iterations)
        self.bodies = [
            self._add_object(placed, shapes, count)
            for placed, shapes, count in zip(self.placed, self._loan.__enter__(), counts, strict=True)
        ]
        self.robots = tuple(
            SapienRobot(
                self._scene,
                arm,
                finger_force_n=closing_force_n,
                contact_offset_m=contact_offset_m,
                second=number > 0,
            )
            for number, arm in enumerate(robot.arms or (robot,))
        )
        self.robot = self.robots[0]
        self._falling, self._expects_load = (
            FreeFallLimiter(self.bodies, timestep_s, contact_offset_m=contact_offset_m),
            False,
        )
        self.expect_load(False)
        self._fixed = [
            (surface, box.name, role) for surface, box, role in zip(surfaces, standing, bearing, strict=True)
        ]
        self._max_contact_force_n = max_contact_force_n
        self.readers = self._readers()
        self.contacts = self.readers[0]

    def __enter__(self) -> RobotWorld:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        del (
            self.contacts,
            self.readers,
            self.robot,
            self.robots,
            self.bodies,
            self._falling,
            self._fixed,
            self.granules,
            self._scene,
            self._system,
        )
        self._loan.__exit__(kind, error, trace)

    def add_ignored_bodies(self, entities: Sequence[sapien.Entity]) -> None:
        """Add bodies without name or role; contact reading ignores them."""
        for entity in entities:
            self._scene.add_entity(entity)
        for reader in self.readers:
            reader.has_strangers = True

    def add_granules(self, fill: GranuleFill) -> None:
        """Put granules into their vessel and let them fall for ``FALL_S``."""
        number = [placed.name for placed in self.placed].index(fill.name)
        self.granules = Granules(fill, self.object_to_world(number))
        self.add_ignored_bodies(self.granules.entities)
        self.step(round(FALL_S / self.timestep_s))

    def step(self, count: int = 1) -> None:
        """Advance by ``count`` time steps."""
        step, look = self._system.step, self._falling.look
        for _ in range(count):
            step()
            look()

    def expect_load(self, held: bool) -> None:
        """Select the solver iterations for a holding or an empty hand; a closing hand ends the treatment of falling objects."""
        if held and not self._expects_load:
            self._falling.end()
        self._expects_load = held
        held_count = self._iterations_held * (SLENDER_FACTOR if self._holds_slender else 1)
        iterations = held_count if held else self._iterations
        for robot in self.robots:
            # also applies to everything that touches the robot
            robot.articulation.set_solver_position_iterations(iterations)

    def set_held_objects(self, names: Collection[str]) -> None:
        """Declare which objects the hand will hold in turn; by default the target alone."""
        self._holds_slender = any(_is_slender(placed.body) for placed in self.placed if placed.name in names)

    def set_target(self, number: int) -> None:
        """Make another object the target."""
        self.target = number
        strangers, used = self.contacts.has_strangers, self.robots.index(self.robot)
        self.readers = self._readers()
        for reader in self.readers:
            reader.has_strangers = strangers
        self.contacts = self.readers[used]

    def select_arm(self, arm: int) -> None:
        """Select the arm, by number, that ``robot`` and ``contacts`` refer to."""
        self.robot, self.contacts = self.robots[arm], self.readers[arm]

    def object_to_world(self, number: int) -> np.ndarray:
        """Return the pose ``(4, 4)`` of an object's frame."""
        return self.bodies[number].entity_pose.to_transformation_matrix().astype(float)

    def pose_of(self, name: str) -> np.ndarray:
        """Return the pose ``(4, 4)`` of an object's frame by name."""
        return self.object_to_world([placed.name for placed in self.placed].index(name))

    def settle(self, seconds: float) -> RestState:
        """Step until the objects rest; the robot holds its targets."""
        return settle(self._system, self.bodies, timestep_s=self.timestep_s, seconds=seconds, limits=RESTS)

    def rest_watch(self, looks: int) -> RestWatch:
        """Return a watch for the rest of all objects over ``looks`` checks, for a caller that steps the world itself."""
        return RestWatch(self.bodies, replace(RESTS, looks=looks))

    def _add_box(self, box: StaticBox, friction: float) -> physx.PhysxRigidStaticComponent:
        offset_m = self._contact_offset_m
        entity = (
            static_plane(friction, friction, contact_offset_m=offset_m, name=box.name)
            if is_plane_equivalent(box)
            else static_box(box, contact_offset_m=offset_m, friction=friction)
        )
        self._scene.add_entity(entity)
        return entity.find_component_by_type(physx.PhysxRigidStaticComponent)

    def _add_object(
        self, placed: PlacedObject, shapes: HullShapes, iterations: int
    ) -> physx.PhysxRigidDynamicComponent:
        component = graspable_component(
            placed.body,
            shapes,
            contact_offset_m=self._contact_offset_m,
            solver_iterations=iterations,
        )
        self._scene.add_entity(entity_at(component, sapien.Pose(placed.object_to_world)))
        return component

    def _readers(self) -> list[ContactReader]:
        """Return a contact reader for each arm."""
        links = [(each.robot.name, name) for each in self.robots for name in each.links]
        arms = {name: arm for arm, name in links} if len(self.robots) > 1 else None
        return [ContactReader(self._system, self._roles(each), self._max_contact_force_n, arms) for each in self.robots]

    def _roles(self, used: SapienRobot) -> list[tuple[physx.PhysxBaseComponent, str, Role]]:
        """Return every body with its name and role as seen by one arm; all links outside its hand, the base included, are ARM."""
        roles: list[tuple[physx.PhysxBaseComponent, str, Role]] = list(self._fixed)
        for number, (body, placed) in enumerate(zip(self.bodies, self.placed, strict=True)):
            roles.append((body, placed.name, Role.TARGET if number == self.target else Role.OTHER))
        for each in self.robots:
            for name, link in each.links.items():
                side = each.robot.contact_side(name) if each is used else None
                hand = Role.HAND if name in each.robot.hand_links else Role.ARM
                roles.append((link, name, hand if side is None else Role(side)))
        return roles


def _is_slender(body: RigidBody) -> bool:
    return bool(np.sqrt(body.principal_inertia[0].min() / body.mass_kg) < SLENDER_M)
