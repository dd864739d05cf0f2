"""Kinematic and collision models of a robot's arm, or of its hand alone, for pinocchio and coal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from manitwin.episodes.planning.convex_shapes import convex_hull, corners_of
from manitwin.episodes.planning.libraries import coal, pin
from manitwin.formats.xml_file import add
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.grippers.suction import SuctionGripper
from manitwin.robots.robot import Robot
from manitwin.robots.urdf import UrdfTree

TURN_RAD = 2 * np.pi


@dataclass(frozen=True)
class KinematicBody:
    """A pinocchio model, its convex collision shapes with the pairs to test, and the joint that carries the gripper.

    ``gripper_to_joint`` is the pose of the grasp frame in the frame of ``joint``. Sets of shape indices: ``touching`` may
    touch the target while holding it, ``fingers`` are those of them on the fingers, ``pressed`` is a cup's lip, which presses
    on the target at the end of the approach, and ``sweeps`` are additional shapes for the volume that each jaw sweeps between
    closed and open, tested while an object is held and when it is released. ``links`` names the link of each shape.
    """

    model: Any
    geometry: Any
    joint: int
    gripper_to_joint: Any
    touching: frozenset[int]
    fingers: frozenset[int] = frozenset()
    pressed: frozenset[int] = frozenset()
    links: tuple[str, ...] = ()
    sweeps: frozenset[int] = frozenset()


def arm_of(robot: Robot, opening_m: float | None = None) -> KinematicBody:
    """Build the arm with its hand open, or at ``opening_m``; joints are ``robot.arm_joints`` in their order."""
    hand = robot.open_hand if opening_m is None else _jaws_at(robot, opening_m)
    model, shapes = _model_of(robot, hand)
    geometry = pin.GeometryModel()
    for shape in shapes:
        geometry.addGeometryObject(shape)
    links = [model.frames[shape.parentFrame].name for shape in shapes]
    disabled = {frozenset(pair) for pair in robot.disabled_pairs}
    for i in range(len(shapes)):
        for j in range(i + 1, len(shapes)):
            apart = shapes[i].parentJoint != shapes[j].parentJoint
            if apart and frozenset((links[i], links[j])) not in disabled:
                geometry.addCollisionPair(pin.CollisionPair(i, j))
    sweeps = list[int]()
    if opening_m != 0 and isinstance(robot.gripper, ParallelGripper):
        closed = _model_of(robot, _jaws_at(robot, 0.0))[1]
        for shape, end, link in zip(shapes, closed, links, strict=True):
            if link in robot.finger_links and (corners := corners_of(shape)) is not None:
                swept = convex_hull(np.concatenate([corners, corners_of(end)]))
                where = shape.parentJoint, shape.parentFrame, pin.SE3.Identity()
                sweeps.append(geometry.addGeometryObject(pin.GeometryObject(f"{link} sweep", *where, swept)))
    tip = model.frames[model.getFrameId(robot.tip_link)]
    holding = {*robot.hand_links, *robot.finger_links}
    return KinematicBody(
        model=model,
        geometry=geometry,
        joint=tip.parentJoint,
        gripper_to_joint=tip.placement * pin.SE3(np.ascontiguousarray(robot.gripper_to_tip)),
        touching=frozenset(i for i, link in enumerate(links) if link in holding),
        fingers=(fingers := frozenset(i for i, link in enumerate(links) if link in robot.finger_links)),
        pressed=fingers if isinstance(robot.gripper, SuctionGripper) else frozenset(),
        links=(*links, *(links[i] for i in sorted(fingers) if sweeps)),
        sweeps=frozenset(sweeps),
    )


def floating_hand_of(arm: KinematicBody) -> KinematicBody:
    """Return everything that moves with the gripper as a free-flying body.

    Its configuration is the grasp frame's pose, position and quaternion xyzw.
    """
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "gripper")
    geometry, kept = pin.GeometryModel(), list[int]()
    joint_to_gripper = arm.gripper_to_joint.inverse()
    for i, shape in enumerate(arm.geometry.geometryObjects):
        if shape.parentJoint == arm.joint:
            placement = joint_to_gripper * shape.placement
            geometry.addGeometryObject(pin.GeometryObject(shape.name, joint, placement, shape.geometry))
            kept.append(i)

    def of(shapes: frozenset[int]) -> frozenset[int]:
        return frozenset(index for index, i in enumerate(kept) if i in shapes)

    links = tuple(arm.links[i] for i in kept)
    parts = of(arm.touching), of(arm.fingers), of(arm.pressed)
    return KinematicBody(model, geometry, joint, pin.SE3.Identity(), *parts, links, of(arm.sweeps))


def broad_phase(model: Any, geometry: Any, data: Any) -> Any:
    """Return coal's sweep-and-prune manager, the fastest of its managers for a few dozen shapes."""
    return pin.BroadPhaseManager_SSaPCollisionManager(model, geometry, data)


def _jaws_at(robot: Robot, opening_m: float) -> np.ndarray:
    return np.full(len(robot.finger_joints), opening_m / 2)


def _model_of(robot: Robot, hand: np.ndarray) -> tuple[Any, list[Any]]:
    """Return the arm's model with the hand's joints locked at ``hand``, and its convex shapes."""
    urdf = _without_continuous_joints(robot.urdf)
    model = pin.buildModelFromXML(urdf)
    geometry = pin.buildGeomFromUrdfString(model, urdf, pin.GeometryType.COLLISION, None, [])
    configuration = pin.neutral(model)
    for name, position in zip(robot.finger_joints, hand, strict=True):
        configuration[model.joints[model.getJointId(name)].idx_q] = position
    locked = [i for i in range(1, model.njoints) if model.names[i] not in robot.arm_joints]
    model, geometry = pin.buildReducedModel(model, geometry, locked, configuration)
    return model, _convex_shapes(geometry, model, robot.finger_links)


def _without_continuous_joints(urdf: str) -> str:
    """Give joints without limits one revolution to either side, so that each has one coordinate."""
    tree = UrdfTree.of_text(urdf)
    for joint in tree.joints.values():
        if joint.get("type") == "continuous":
            joint.set("type", "revolute")
            limit = joint.find("limit")
            if limit is None:
                limit = add(joint, "limit", effort="1000", velocity="10")
            limit.set("lower", str(-TURN_RAD))
            limit.set("upper", str(TURN_RAD))
    return tree.text()


def _convex_shapes(geometry: Any, model: Any, finger_links: tuple[str, ...]) -> list[Any]:
    """Return the shapes, with meshes replaced by their convex hulls and each finger by the convex hull of its parts."""
    shapes: list[Any] = []
    fingers: dict[str, list[Any]] = {link: [] for link in finger_links}
    for shape in geometry.geometryObjects:
        if isinstance(shape.geometry, coal.BVHModelBase):
            shape.geometry.buildConvexHull(True, "Qt")
            shape.geometry = shape.geometry.convex
        link = model.frames[shape.parentFrame].name
        (fingers[link] if link in fingers and corners_of(shape) is not None else shapes).append(shape)
    for link, pieces in fingers.items():
        if len(pieces) == 1:
            shapes += pieces
        elif pieces:
            corners = np.concatenate([corners_of(piece) for piece in pieces])
            first = pieces[0]
            shapes.append(
                pin.GeometryObject(link, first.parentJoint, first.parentFrame, pin.SE3.Identity(), convex_hull(corners))
            )
    return shapes
