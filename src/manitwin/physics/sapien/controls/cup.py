"""Suction cup controller: the cup seals where its lip touches with vacuum on, and detaches beyond the lip's load limits.

To seal, the lip must be in contact with the object, and its ring must seal on the true surface at that pose
(``suction.seal``). The object is then attached to the lip by a stiff spring of limited force. The load on the lip is the
object's weight and inertial force less the other contact forces (Newton, Euler). If ``suction.lip_load`` exceeds 1, the cup
detaches, as in the trial.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import sapien
from sapien import physx

from manitwin.geometry.poses import inverse, transform, transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.physics.sapien.contacts import TargetContacts
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.suction import lip_load, seal
from manitwin.physics.trial import GRAVITY_M_S2, TrialSettings
from manitwin.robots.grippers.suction import SuctionGripper

# Stiffness of the sealed bellows: 1 kg lowers the lip by 1 mm, and tilts it by 1 degree if its weight is 9 cm off the axis.
STIFFNESS_N_M, DAMPING_N_S_M = 1e4, 100.0
VACUUM_ON = 0.5  # threshold of the vacuum command, which is 0 or 1
TURN_STIFFNESS_NM_RAD, TURN_DAMPING_NM_S_RAD = 50.0, 1.0


@dataclass
class _Sealed:
    """Object attached to the lip, by its number in the world; ``center_m``, ``inward (3,)`` of the lip's plane in its frame."""

    number: int
    drive: physx.PhysxDriveComponent
    center_m: np.ndarray
    inward: np.ndarray
    velocity_m_s: np.ndarray


class CupControl:
    """Controller of a suction cup; its target is vacuum on (1) or off (0), its state the plunger's position (m)."""

    def __init__(self, world: RobotWorld, gripper: SuctionGripper, settings: TrialSettings):
        """Take a world whose robot has its vacuum off."""
        self._world, self._gripper, self._settings = world, gripper, settings
        (self._lip_name,) = world.robot.robot.finger_links
        self._on, self._pressure_n = False, 0.0
        self._sealed: _Sealed | None = None
        self._surfaces: dict[int, RayCaster] = {}

    @property
    def told(self) -> np.ndarray:
        """Whether the vacuum is on, ``(1,)``."""
        return np.array([float(self._on)])

    @property
    def state(self) -> np.ndarray:
        """The plunger's position ``(1,)`` m."""
        return self._world.robot.hand_positions()

    @property
    def presses(self) -> bool:
        """Whether the cup has sealed."""
        return self._sealed is not None

    def tell(self, told: np.ndarray) -> None:
        """Switch the vacuum on for a target above one half, otherwise off."""
        on = float(told[0]) > VACUUM_ON
        if self._on and not on:
            self._detach()
        self._on = on

    def shaping(self, grasp_joints_rad: np.ndarray | None, opening_m: float | None = None) -> Iterator[np.ndarray]:
        """Do nothing."""
        return iter(())

    def squeeze(self) -> np.ndarray:
        """Return the target that switches the vacuum on."""
        return np.ones(1)

    def closing_empty(self) -> Iterator[np.ndarray]:
        """Do nothing: only jaws are used as a tool."""
        return iter(())

    def opening(self) -> Iterator[np.ndarray]:
        """Yield the target that switches the vacuum off."""
        yield np.zeros(1)

    def look(self, contacts: Sequence[physx.PhysxContact]) -> None:
        """Seal on an object that the lip touches, or detach if the sealed lip is overloaded."""
        if self._sealed is not None:
            self._bear(self._sealed, contacts)
        elif self._on:
            for number, placed in enumerate(self._world.placed):
                touched = (
                    self._world.contacts.resultant_force(contacts, placed.name, frozenset({self._lip_name})) is not None
                )
                if touched and self._try_to_seal(number):
                    break

    def touches(self, touches: TargetContacts) -> TargetContacts:
        """Return the pressing force of the lip: the vacuum force less the pull on it; 0 if it is not sealed."""
        return TargetContacts((self._pressure_n, self._pressure_n), touches.on_support)

    def _try_to_seal(self, number: int) -> bool:
        lip_to_world = self._world.robot.gripper_pose() @ transform(translation=np.array([0, 0, self.state[0]]))
        object_to_world = self._world.object_to_world(number)
        found = seal(self._gripper, (inverse(object_to_world) @ lip_to_world)[None], self._surface(number))
        if not found.sealed[0]:
            return False
        body = self._world.bodies[number]
        drive = physx.PhysxDriveComponent(body)
        drive.parent = lip = self._world.robot.links[self._lip_name]
        drive.pose_in_parent, drive.pose_in_child = lip.entity_pose.inv() * body.entity_pose, sapien.Pose()
        vacuum_n = self._settings.force_n
        for set_property in (drive.set_drive_property_x, drive.set_drive_property_y, drive.set_drive_property_z):
            set_property(STIFFNESS_N_M, DAMPING_N_S_M, vacuum_n, "force")
        turn_limit_nm = vacuum_n * self._gripper.lip_radius_m
        drive.set_drive_property_slerp(TURN_STIFFNESS_NM_RAD, TURN_DAMPING_NM_S_RAD, turn_limit_nm, "force")
        body.entity.add_component(drive)
        velocity_m_s = np.array(body.linear_velocity, float)
        self._sealed = _Sealed(number, drive, found.center_m[0], found.inward[0], velocity_m_s)
        self._pressure_n = vacuum_n
        self._world.robot.block_plunger(True)
        return True

    def _bear(self, held: _Sealed, contacts: Sequence[physx.PhysxContact]) -> None:
        """Compute the load on the lip, and detach if it exceeds the limits."""
        placed, body = self._world.placed[held.number], self._world.bodies[held.number]
        object_to_world = self._world.object_to_world(held.number)
        rotation, velocity_m_s = object_to_world[:3, :3], np.array(body.linear_velocity, float)
        acceleration = (velocity_m_s - held.velocity_m_s) / self._settings.timestep_s
        held.velocity_m_s = velocity_m_s
        names = frozenset(name for name in self._world.contacts.names if name != placed.name)
        push = self._world.contacts.resultant_force(contacts, placed.name, names)
        borne_n = np.zeros(3) if push is None else push.force_n
        force_n = placed.body.mass_kg * (np.array([0, 0, -GRAVITY_M_S2]) - acceleration) + borne_n
        center_m, lip_m = transform_points(object_to_world, np.array([placed.body.center_of_mass_m, held.center_m]))
        inward = rotation @ held.inward
        share = lip_load(
            force_n,
            center_m - lip_m,
            inward,
            vacuum_force_n=self._settings.force_n,
            friction=(self._settings.finger_friction + placed.body.friction_static) / 2,
            lip_radius_m=self._gripper.lip_radius_m,
        )
        self._pressure_n = max(0.0, self._settings.force_n - float(force_n @ inward))
        if share > 1:
            self._detach()

    def _detach(self) -> None:
        if self._sealed is not None:
            self._sealed.drive.entity.remove_component(self._sealed.drive)
            self._world.robot.block_plunger(False)
        self._sealed, self._pressure_n = None, 0.0

    def _surface(self, number: int) -> RayCaster:
        if number not in self._surfaces:
            body = self._world.placed[number].body
            self._surfaces[number] = RayCaster.of_hulls(body.hulls) if body.surface is None else body.surface
        return self._surfaces[number]
