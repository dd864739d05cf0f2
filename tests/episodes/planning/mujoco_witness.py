"""Distances in MuJoCo between a robot, what stands around it and its target: what a plan is judged by."""

from __future__ import annotations

from dataclasses import dataclass

import lxml.etree
import mujoco
import numpy as np

from manitwin.episodes.planning.problem import PickPlaceProblem
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.robots.robot import Robot

FAR_M = 0.1


@dataclass(frozen=True)
class Gaps:
    """The least distances (m), negative where things overlap; what is further than 10 cm counts as 10 cm.

    The robot's base stands on the table, and is no part of it but towards the target and its own links. The arm is all
    but the hand.
    """

    robot_to_surroundings: float
    robot_to_target: float
    arm_to_target: float
    target_to_surroundings: float
    robot_to_itself: float


class Witness:
    """The robot with open fingers, the furniture, the other objects and the target, every hull a geom of its own."""

    def __init__(self, robot: Robot, problem: PickPlaceProblem):
        spec = mujoco.MjSpec.from_string(simulated_urdf(robot))
        own = {body.name for body in spec.bodies}
        world = spec.worldbody
        for box in problem.static_boxes:
            body = world.add_body(name=f"around {box.name}", pos=box.box_to_world[:3, 3])
            body.quat = quaternion_wxyz(box.box_to_world[:3, :3])
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=box.half_extents_m)
        for placed in (*problem.obstacles, problem.target):
            is_target = placed is problem.target
            body = world.add_body(name="target" if is_target else f"around {placed.name}", mocap=True)
            for number, vertices in enumerate(placed.body.hulls):
                name = f"{placed.name} {number}"
                spec.add_mesh(name=name, uservert=np.asarray(vertices, np.float32).ravel(), inertia=_SHELL)
                body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._joints = [self._model.joint(name).qposadr[0] for name in robot.arm_joints]
        for name in robot.finger_joints:
            self._data.qpos[self._model.joint(name).qposadr[0]] = robot.gripper.opening_m / 2
        for placed in problem.obstacles:
            self._put(f"around {placed.name}", placed.object_to_world)
        bodies = [self._model.body(self._model.geom_bodyid[i]).name for i in range(self._model.ngeom)]
        base = self._model.body(min(self._model.body(name).id for name in own if name != "world")).name
        links = [i for i, name in enumerate(bodies) if name in own]
        self._robot = [i for i in links if bodies[i] != base]
        holding = {*robot.hand_links, *robot.finger_links}
        self._arm = [i for i in links if bodies[i] not in holding]
        self._target = [i for i, name in enumerate(bodies) if name == "target"]
        self._around = [i for i, name in enumerate(bodies) if name.startswith("around ")]
        disabled = {frozenset(pair) for pair in robot.disabled_pairs}
        self._own_pairs = [
            (i, j)
            for i in links
            for j in links
            if i < j and bodies[i] != bodies[j] and frozenset((bodies[i], bodies[j])) not in disabled
        ]

    def gaps(self, joint_positions_rad: np.ndarray, target_to_world: np.ndarray) -> Gaps:
        """Return the least distances with the arm at joint positions and the target at a pose."""
        self._data.qpos[self._joints] = joint_positions_rad
        self._put("target", target_to_world)
        mujoco.mj_kinematics(self._model, self._data)
        return Gaps(
            self._least(self._robot, self._around),
            self._least(self._robot, self._target),
            self._least(self._arm, self._target),
            self._least(self._target, self._around),
            min((self._distance(i, j) for i, j in self._own_pairs), default=FAR_M),
        )

    def _put(self, body: str, pose: np.ndarray) -> None:
        number = self._model.body(body).mocapid[0]
        self._data.mocap_pos[number] = pose[:3, 3]
        self._data.mocap_quat[number] = quaternion_wxyz(pose[:3, :3])

    def _least(self, first: list[int], second: list[int]) -> float:
        return min((self._distance(i, j) for i in first for j in second), default=FAR_M)

    def _distance(self, first: int, second: int) -> float:
        centers, radii = self._data.geom_xpos, self._model.geom_rbound
        if np.linalg.norm(centers[first] - centers[second]) - radii[first] - radii[second] > FAR_M:
            return FAR_M
        return float(mujoco.mj_geomDistance(self._model, self._data, first, second, FAR_M, None))


_SHELL = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL


def simulated_urdf(robot: Robot) -> str:
    """Return the robot's URDF without what MuJoCo cannot read, its links kept apart."""
    root = lxml.etree.fromstring(robot.urdf.encode())
    for tag in ("visual", "material", "mimic"):
        for element in list(root.iter(tag)):
            element.getparent().remove(element)
    options = {"strippath": "false", "fusestatic": "false"}
    lxml.etree.SubElement(lxml.etree.SubElement(root, "mujoco"), "compiler", options)
    return str(lxml.etree.tostring(root, encoding="unicode"))
