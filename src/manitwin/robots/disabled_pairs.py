"""Collision filter of a robot: link pairs that are not tested for collision, from an SRDF or by random sampling.

The criteria are those of MoveIt's Setup Assistant (Coleman et al. 2014): adjacent links, links in collision in the default
state, and links always in collision (there 95 % of random states; here ``CONTACT_SHARE``).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.errors import ConfigError, Unavailable
from manitwin.formats.installation import import_remedy
from manitwin.formats.printable import printable_line
from manitwin.formats.xml_file import read_xml
from manitwin.robots.definition import RobotDefinition
from manitwin.robots.links import LinkShape, read_urdf_links
from manitwin.robots.urdf import UrdfTree, child_of, parent_of

STATES = 300
CONTACT_SHARE = 0.9
MOST_PAIRS = 5_000
"""About a hundred shapes that all move relative to each other: each pair is tested in every state."""
SEED = 0
Pairs = tuple[tuple[str, str], ...]


def disabled_pairs(tree: UrdfTree, srdf: Path | None, definition: RobotDefinition, palm: str) -> Pairs:
    """Return the disabled pairs, each sorted, in sorted order.

    Raises Unavailable if the extra that computes them is not installed.
    """
    pairs = _adjacent(tree) | _within_hand(tree, palm)
    if srdf is not None:
        pairs |= _of_srdf(srdf, tree)
    else:
        pairs |= _contact_pairs(tree, definition)
    return tuple(sorted(pairs))


def _pair(first: str, second: str) -> tuple[str, str]:
    return (first, second) if first < second else (second, first)


def _adjacent(tree: UrdfTree) -> set[tuple[str, str]]:
    """Return pairs of links connected by a joint; links without shapes are replaced by their nearest links with shapes."""
    return {
        _pair(first, second)
        for joint in tree.joints.values()
        for first in _nearest_solid_links(tree, parent_of(joint), up=True)
        for second in _nearest_solid_links(tree, child_of(joint), up=False)
        if first != second
    }


def _nearest_solid_links(tree: UrdfTree, link: str, up: bool) -> Iterable[str]:
    """Return the link itself if it has shapes, otherwise the nearest links with shapes above or below it across fixed joints."""
    if tree.links[link].find("collision") is not None:
        return [link]
    near = [
        (parent_of(joint) if up else child_of(joint))
        for joint in tree.joints.values()
        if (child_of(joint) if up else parent_of(joint)) == link and joint.get("type") == "fixed"
    ]
    return [name for other in near for name in _nearest_solid_links(tree, other, up)]


def _within_hand(tree: UrdfTree, palm: str) -> set[tuple[str, str]]:
    """Return all pairs within the hand, because the fingers touch when it closes."""
    hand = tree.subtree_links(palm)
    return {_pair(first, second) for first, second in combinations(hand, 2)}


def _of_srdf(path: Path, tree: UrdfTree) -> set[tuple[str, str]]:
    found = set()
    for element in read_xml(path, "robot", name=str(path), refusal=ConfigError).findall("disable_collisions"):
        first, second = element.get("link1"), element.get("link2")
        if first in tree.links and second in tree.links:
            found.add(_pair(first, second))
    if not found:
        raise ConfigError(f"{path}: it lists no pair of the robot's links; leave srdf out to compute the pairs")
    return found


def _check_pairs(shapes: Counter[int], name: str) -> None:
    """Raise ConfigError if the shapes, counted per joint, make too many pairs; shapes of one joint form no pairs."""
    count = shapes.total()
    pairs = (count**2 - sum(each**2 for each in shapes.values())) // 2
    if pairs > MOST_PAIRS:
        raise ConfigError(
            f"{name}: {count:,} collision shapes make {pairs:,} pairs, of which at most {MOST_PAIRS:,} are tried; give an"
            " SRDF, or fewer shapes"
        )


def _contact_pairs(tree: UrdfTree, definition: RobotDefinition) -> set[tuple[str, str]]:
    """Return pairs whose convex hulls collide at home, or in at least 90 % of random joint states."""
    try:
        import coal
        import pinocchio as pin
    except ImportError as error:
        remedy = import_remedy(error, "pip install 'manitwin[robots]'")
        raise Unavailable(f"robots without an SRDF need pin and coal ({error}): {remedy}") from error
    urdf = tree.text()
    try:
        model, geometry = pin.buildModelFromXML(urdf), pin.GeometryModel()
    except ValueError as error:
        said = printable_line(str(error), max_characters=120)
        raise ConfigError(
            f"{definition.name}: Pinocchio cannot read its URDF ({said}); correct its numbers and joints"
        ) from error
    owners: list[str] = []
    links_with_shapes = [(model.frames[model.getBodyId(link.name)], link) for link in read_urdf_links(urdf)]
    shapes = Counter[int]()
    for frame, link in links_with_shapes:
        shapes[frame.parentJoint] += len(link.shapes)
    _check_pairs(shapes, definition.name)
    for frame, link in links_with_shapes:
        for shape in link.shapes:
            placement = frame.placement * pin.SE3(np.ascontiguousarray(shape.shape_to_link))
            convex = _convex(coal, shape)
            geometry.addGeometryObject(pin.GeometryObject(f"{len(owners)}", frame.parentJoint, placement, convex))
            owners.append(link.name)
    geometry.addAllCollisionPairs()
    data, geometry_data = model.createData(), geometry.createData()
    links = [_pair(owners[pair.first], owners[pair.second]) for pair in geometry.collisionPairs]
    home = pin.neutral(model)
    for name, value in zip(definition.arm_joints, definition.home_rad, strict=True):
        home[model.joints[model.getJointId(name)].idx_q] = value
    rng = np.random.default_rng(SEED)
    count: dict[tuple[str, str], int] = {}
    for state in range(STATES + 1):
        at_home = state == 0
        joints = home if at_home else rng.uniform(model.lowerPositionLimit, model.upperPositionLimit)
        pin.computeCollisions(model, data, geometry, geometry_data, joints, False)
        touching = {pair for pair, r in zip(links, geometry_data.collisionResults, strict=True) if r.isCollision()}
        for pair in touching:
            count[pair] = count.get(pair, 0) + (STATES if at_home else 1)
    return {pair for pair, times in count.items() if times >= CONTACT_SHARE * STATES}


def _convex(coal: Any, shape: LinkShape) -> Any:
    if shape.half_extents_m is not None:
        return coal.Box(*(2 * shape.half_extents_m))
    if shape.radius_m is not None:
        return coal.Sphere(shape.radius_m)
    points = coal.StdVec_Vec3s()
    points.extend(np.asarray(shape.corners_m))
    return coal.ConvexBase.convexHull(points, True, "Qt")
