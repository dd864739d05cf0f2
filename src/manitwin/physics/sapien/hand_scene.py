"""SAPIEN 3 scene of a grasp trial: one object and one stationary hand (PhysX 5 on the CPU).

Settings as measured: 20 solver iterations at 1/240 s, gravity from the lift on.

PhysX would apply weight and inertial force to the object at once when a step begins, while the closing force reaches the
contacts in equal parts over the solver's substeps. The first substeps would lack the normal force to resist, and a heavy
object would creep (measured: 6 mm at 4 kg where friction carries 5.6 kg, 0.8 mm as implemented here). The load is therefore
applied by a drive, which the solver also distributes over the substeps.
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
LOAD_RATE_PER_S = 0.01  # damping of the load drive per mass: 1e-4 of the weight at 0.1 m/s in the hand


class SapienHand(Protocol):
    """Stationary hand in a scene; ``is_ahead``: its precomputed state already includes the steps to come."""

    is_ahead: bool

    def joints(self) -> np.ndarray:
        """Return the joint positions ``(J,)``, m or rad."""
        ...

    def squeeze(self) -> None:
        """Close by one frame, until the hand presses with the closing force."""
        ...

    def presses(self) -> bool:
        """Tell whether the hand presses with the closing force."""
        ...

    def pressing_n(self, pushes: list[tuple[int, np.ndarray]]) -> tuple[float, ...]:
        """Return the force of each side, given the contact forces (N, hand's frame) on the object by body (``per_scene_id``)."""
        ...


class HandScene:
    """Scene of one grasp (``TrialScene``), in the hand's frame."""

    def __init__(
        self,
        body: RigidBody,
        shapes: HullShapes,
        object_to_hand: np.ndarray,
        settings: TrialSettings,
        make_hand: Callable[[sapien.Scene], SapienHand],
    ):
        """Place the body, with these ``shapes``, in front of the hand."""
        self.settings = settings
        self.system = weightless_system(settings.timestep_s)
        self.scene = scene = sapien.Scene([self.system])  # kept alive: bodies are destroyed with their scene
        self.object = graspable_component(
            body,
            shapes,
            contact_offset_m=settings.contact_offset_m,
            solver_iterations=settings.solver_iterations,
        )
        self.object.set_sleep_threshold(0.0)  # an object at rest in the hand must not sleep
        self.entity = entity_at(self.object, sapien.Pose(object_to_hand))
        self.load = _load(self.object)
        self.entity.add_component(self.load)
        scene.add_entity(self.entity)
        self.hand = make_hand(scene)
        self.in_object_m = body.center_of_mass_m
        self.looks = [object_to_hand]
        self._pose: np.ndarray | None = None  # object pose, cached until the next step
        # Last loads whose rows are all equal (while the hand closes, and while it waits): the drive target is then set once.
        self._even_loads: np.ndarray | None = None

    def advance(self, loads_m_s2: np.ndarray) -> None:
        """Take one step for each row of accelerations ``(N, 3)`` m/s^2."""
        self._pose = None
        if self.hand.is_ahead and not loads_m_s2.any():  # no contact and no load, so the object does not move
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
        """Tell whether the hand presses with the closing force."""
        return self.hand.presses()

    def contacts(self) -> HandContacts:
        """Return the force of each side of the hand, and the deepest overlap (m) of hand and object."""
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
        """Return the object's rotation ``(3, 3)`` in the hand's frame."""
        return self._look()[:3, :3]

    def center_of_mass_m(self) -> np.ndarray:
        """Return the object's centre of mass ``(3,)`` m in the hand's frame."""
        pose = self._look()
        return pose[:3, :3] @ self.in_object_m + pose[:3, 3]

    def object_to_hand(self) -> np.ndarray:
        """Return the object's pose ``(4, 4)`` in the hand's frame."""
        return np.asarray(self.object.entity_pose.to_transformation_matrix(), float)

    def hand_joints(self) -> np.ndarray:
        """Return the hand's joint positions ``(J,)``."""
        return self.hand.joints()

    def _look(self) -> np.ndarray:
        """Return the object's pose ``(4, 4)`` in the hand's frame, and append it to ``looks``."""
        if self._pose is None:
            self._pose = self.object_to_hand()
            self.looks.append(self._pose)
        return self._pose


def _load(target: physx.PhysxRigidDynamicComponent) -> physx.PhysxDriveComponent:
    """Return the drive that loads the object at its centre of mass: a weak damper with a very large velocity target.

    Its force is ``mass * LOAD_RATE_PER_S * (velocity target - velocity)``, which is constant except for a negligible drag.
    """
    load = physx.PhysxDriveComponent(target)
    load.pose_in_child = target.cmass_local_pose
    for set_property in (load.set_drive_property_x, load.set_drive_property_y, load.set_drive_property_z):
        set_property(0.0, target.mass * LOAD_RATE_PER_S)
    return load
