"""One object in front of one still hand in SAPIEN 3 (PhysX 5 on the CPU), in a scene of their own.

Settings as measured: 20 solver iterations at 1/240 s, gravity from the lift on.

PhysX would give weight and inertial force to the object at once when a step begins, while the closing force reaches the
contacts in equal parts over the solver's substeps: the first of them would lack the normal force to resist, and a heavy
object would creep (measured: 6 mm at 4 kg where friction carries 5.6 kg, 0.8 mm as below). So the load enters as a
drive, which the solver applies in every substep as well.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
import sapien
from sapien import physx

from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.sapien.body import entity_at, graspable_component
from manitwin.physics.sapien.scene import weightless_system
from manitwin.physics.sapien.shapes import HullShapes
from manitwin.physics.trial import TrialSettings
from manitwin.physics.trial_phases import HandContacts

NO_SPIN = np.zeros(3, np.float32)
LOAD_RATE_PER_S = 0.01  # drag of the load's drive per mass: 1e-4 of the weight at 0.1 m/s in the hand


class SapienHand(Protocol):
    """A hand in a scene, which stays where it is; ``is_ahead`` where it is already as the steps to come would leave it."""

    is_ahead: bool

    def joints(self) -> np.ndarray:
        """Return the positions ``(J,)`` of its joints, m or rad."""
        ...

    def squeeze(self) -> None:
        """Close by one frame, until it presses as hard as it should."""
        ...

    def presses(self) -> bool:
        """Tell whether it presses as hard as it should."""
        ...

    def pressing_n(self, pushes: list[tuple[int, np.ndarray]]) -> tuple[float, ...]:
        """Return how hard each side presses, given which body (by ``per_scene_id``) pushes the object how (N, hand's frame)."""
        ...


class HandScene:
    """One grasp in one scene; its frame is the hand's."""

    def __init__(
        self,
        body: RigidBody,
        shapes: HullShapes,
        object_to_hand: np.ndarray,
        settings: TrialSettings,
        make_hand: Callable[[sapien.Scene], SapienHand],
    ):
        """Put the body, of these ``shapes``, before the hand."""
        self.settings = settings
        self.system = weightless_system(settings.timestep_s)
        self.scene = scene = sapien.Scene([self.system])  # kept: bodies go with their scene
        self.object = graspable_component(
            body,
            shapes,
            contact_offset_m=settings.contact_offset_m,
            solver_iterations=settings.solver_iterations,
        )
        self.object.set_sleep_threshold(0.0)  # at rest in the hand is not at rest
        self.entity = entity_at(self.object, sapien.Pose(object_to_hand))
        self.load = _load(self.object)
        self.entity.add_component(self.load)
        scene.add_entity(self.entity)
        self.hand = make_hand(scene)
        self.in_object_m = body.center_of_mass_m
        self.looks = [object_to_hand]
        self._pose: np.ndarray | None = None  # of the object, since the last step
        # Loads of which each step has the same, as they were given last: while the hand closes, and where it waits.
        self._even_loads: np.ndarray | None = None

    def advance(self, loads_m_s2: np.ndarray) -> None:
        """Take one step for each row of accelerations ``(N, 3)``."""
        self._pose = None
        if self.hand.is_ahead and not loads_m_s2.any():  # nothing touches the object, and nothing else loads it
            return
        set_target, step = self.load.set_drive_velocity_target, self.system.step
        if loads_m_s2 is not self._even_loads:
            targets = (loads_m_s2 / LOAD_RATE_PER_S).astype(np.float32)
            self._even_loads = loads_m_s2 if bool((targets == targets[:1]).all()) else None
            if self._even_loads is None:
                for target in targets:
                    set_target(target, NO_SPIN)
                    step()
                return
            set_target(targets[0], NO_SPIN)
        for _ in range(len(loads_m_s2)):
            step()

    def squeeze(self) -> None:
        """Close the hand by one frame."""
        self.hand.squeeze()

    def presses(self) -> bool:
        """Tell whether the hand presses with the closing force by now."""
        return self.hand.presses()

    def contacts(self) -> HandContacts:
        """Return how hard each side of the hand presses, and the deepest overlap with the hand."""
        pushes, deepest = [], 0.0
        target = self.entity.per_scene_id
        for contact in self.system.get_contacts():
            first, second = (body.entity.per_scene_id for body in contact.bodies)
            if target not in (first, second):
                continue
            other, sign = (second, 1) if first == target else (first, -1)
            for point in contact.points:
                deepest = max(deepest, -point.separation)
                pushes.append((other, sign * point.impulse / self.settings.timestep_s))
        return HandContacts(self.hand.pressing_n(pushes), deepest)

    def object_rotation(self) -> np.ndarray:
        """Return the object's rotation in the hand's frame."""
        return self._look()[:3, :3]

    def center_of_mass_m(self) -> np.ndarray:
        """Return the object's centre of mass in the hand's frame."""
        pose = self._look()
        return pose[:3, :3] @ self.in_object_m + pose[:3, 3]

    def object_to_hand(self) -> np.ndarray:
        """Return the object's pose ``(4, 4)`` in the hand's frame."""
        return np.asarray(self.object.entity_pose.to_transformation_matrix(), float)

    def hand_joints(self) -> np.ndarray:
        """Return the hand's state ``(J,)``."""
        return self.hand.joints()

    def _look(self) -> np.ndarray:
        """Return the object's pose ``(4, 4)`` in the hand's frame, and keep it in ``looks``."""
        if self._pose is None:
            self._pose = self.object_to_hand()
            self.looks.append(self._pose)
        return self._pose


def _load(target: physx.PhysxRigidDynamicComponent) -> physx.PhysxDriveComponent:
    """Build the drive that loads the object at its centre of mass: a weak damper towards a far-off velocity.

    It gives ``mass * LOAD_RATE_PER_S * (velocity target - velocity)``, which is constant but for a negligible drag.
    """
    load = physx.PhysxDriveComponent(target)
    load.pose_in_child = target.cmass_local_pose
    for set_property in (load.set_drive_property_x, load.set_drive_property_y, load.set_drive_property_z):
        set_property(0.0, target.mass * LOAD_RATE_PER_S)
    return load
