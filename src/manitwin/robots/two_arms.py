"""Two-arm robots: a TOML file that names two robots and the poses of their bases.

Each arm is a robot of its own. Its link and joint names are prefixed with the arm's name, and its URDF has a world link as
root, from which planner and simulation take the base pose. World frame: +Z up, the table top is the plane z = 0.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from lxml import etree  # type: ignore[import-untyped]
from pydantic import BaseModel, Field, ValidationError

from manitwin.errors import ConfigError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.toml_file import MAX_TOML_BYTES, parse_toml
from manitwin.formats.xml_file import add, new_element
from manitwin.robots.assembly import add_joint
from manitwin.robots.definition import PoseField
from manitwin.robots.grippers.box import STRICT
from manitwin.robots.robot import Robot
from manitwin.robots.urdf import UrdfTree, origin_of, set_origin

WORLD = "world"


class ArmField(BaseModel):
    """One arm: its name, a single-arm robot, and the pose of that robot's base in the world."""

    model_config = STRICT
    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,30}$")]
    robot: str
    base_to_world: PoseField


class TwoArmsDefinition(BaseModel):
    """Schema of a two-arm file; the first arm's base is at the origin, like that of a single-arm robot."""

    model_config = STRICT
    name: str
    source: str
    arms: Annotated[tuple[ArmField, ...], Field(min_length=2, max_length=2)]


def is_two_arm_file(path: Path) -> bool:
    """Tell whether a robot file defines two arms; raises ConfigError if the file cannot be read."""
    return "arms" in parse_toml(_content(path), f"robot file {path}", ConfigError)


def load_two_arms(path: Path, load: Callable[[str], Robot]) -> Robot:
    """Return both arms as one robot with ``arms``; ``load`` loads a single-arm robot by name.

    Raises ConfigError naming the file, the problem and valid values.
    """
    content = _content(path)
    try:
        definition = TwoArmsDefinition.model_validate(parse_toml(content, f"robot file {path}", ConfigError))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ConfigError(f"robot file {path}: {where}: {first['msg']}") from error
    names = [each.name for each in definition.arms]
    if len(set(names)) != len(names):
        raise ConfigError(f"robot file {path}: two arms are named {names[0]}; give each a name of its own")
    if not np.allclose(definition.arms[0].base_to_world.matrix(), np.eye(4), atol=1e-9):
        raise ConfigError(f"robot file {path}: arm {names[0]} is not at the origin; move the world's frame to its base")
    own = [load(each.robot) for each in definition.arms]
    for name, robot in zip(names, own, strict=True):
        if not robot.has_jaws or robot.gripper.sha256 != own[0].gripper.sha256:
            raise ConfigError(
                f"robot file {path}: arm {name} has {robot.gripper.name}; both arms need the same two-jaw gripper"
            )
    arms = [
        place_arm(robot, each.name, each.base_to_world.matrix())
        for robot, each in zip(own, definition.arms, strict=True)
    ]
    digests = (hashlib.sha256(content).hexdigest(), *(robot.sha256 for robot in own))
    return _combine_arms(definition, arms, hashlib.sha256("\n".join(digests).encode()).hexdigest())


def place_arm(robot: Robot, name: str, base_to_world: np.ndarray) -> Robot:
    """Return a single-arm robot as the arm ``name``, with its base fixed at a pose ``(4, 4)`` in the world."""
    tree = UrdfTree.of_text(robot.urdf)
    (base,) = tree.roots()
    for element in (*tree.links.values(), *tree.joints.values()):
        element.set("name", prefixed_name(name, element.get("name")))
    for tag, key in (("parent", "link"), ("child", "link"), ("mimic", "joint")):
        for element in tree.element.iterfind(f"joint/{tag}"):
            element.set(key, prefixed_name(name, element.get(key)))
    world = prefixed_name(name, WORLD)
    add(tree.element, "link", name=world)
    joint = add_joint(tree.element, f"{world}_joint", "fixed", world, prefixed_name(name, base))
    set_origin(joint, base_to_world)

    def of(names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(prefixed_name(name, each) for each in names)

    return replace(
        robot,
        name=name,
        urdf=tree.text(),
        arm_joints=of(robot.arm_joints),
        finger_joints=of(robot.finger_joints),
        tip_link=prefixed_name(name, robot.tip_link),
        hand_links=of(robot.hand_links),
        finger_links=of(robot.finger_links),
        disabled_pairs=tuple((prefixed_name(name, one), prefixed_name(name, two)) for one, two in robot.disabled_pairs),
    )


def base_to_world(arm: Robot) -> np.ndarray:
    """Return the base pose ``(4, 4)`` of one of two arms in the world."""
    return origin_of(UrdfTree.of_text(arm.urdf).joint(f"{prefixed_name(arm.name, WORLD)}_joint"))


def prefixed_name(arm: str, name: str) -> str:
    """Return the name of a link or joint with its arm's prefix."""
    return f"{arm}_{name}"


def _combine_arms(definition: TwoArmsDefinition, arms: list[Robot], sha256: str) -> Robot:
    """Return both arms as one robot: concatenated joints, links and limits; hand and workspace of the first."""
    first, second = arms

    def both(name: str) -> tuple[str, ...]:
        return (*getattr(first, name), *getattr(second, name))

    return replace(
        first,
        name=definition.name,
        sha256=sha256,
        source=definition.source,
        urdf=_one_tree(definition.name, arms),
        arm_joints=both("arm_joints"),
        finger_joints=both("finger_joints"),
        hand_links=both("hand_links"),
        finger_links=both("finger_links"),
        disabled_pairs=(*first.disabled_pairs, *second.disabled_pairs),
        home_rad=np.concatenate([first.home_rad, second.home_rad]),
        velocity_limits_rad_s=np.concatenate([first.velocity_limits_rad_s, second.velocity_limits_rad_s]),
        fastest_rad_s=np.concatenate([first.fastest_rad_s, second.fastest_rad_s]),
        acceleration_limits_rad_s2=np.concatenate(
            [first.acceleration_limits_rad_s2, second.acceleration_limits_rad_s2]
        ),
        arms=(first, second),
    )


def _one_tree(name: str, arms: list[Robot]) -> str:
    together: etree._Element = new_element("robot", name=name)
    add(together, "link", name=WORLD)
    for arm in arms:
        for element in list(UrdfTree.of_text(arm.urdf).element):
            together.append(element)
        root = prefixed_name(arm.name, WORLD)
        set_origin(add_joint(together, f"{root}_at", "fixed", WORLD, root), np.eye(4))
    return UrdfTree(f"robot {name}", together).text()


def _content(path: Path) -> bytes:
    return read_bytes(path, MAX_TOML_BYTES, ConfigError, name=f"robot file {path}")
