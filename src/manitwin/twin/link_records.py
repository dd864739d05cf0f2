"""Links and joints of an articulated twin, and the file that assigns each face to a link."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from manitwin.twin.record_values import LARGEST_KG, LARGEST_M, Finite, Matrix3, Record, Vector3

if TYPE_CHECKING:
    from manitwin.geometry.articulation import ArticulatedJoint

FACE_LINKS = "face_links.npy"
"""One ``uint8`` per face of visual.glb, in the order of ``formats.glb.read_glb``: the index of its link."""
MAX_LINKS = 32
"""The number of collision hulls of a twin, as each link needs at least one."""
_UNIT_TOLERANCE = 1e-6


class Joint(Record):
    """A joint with one degree of freedom, in the object frame, for the pose of the twin with the joint at ``locked_at``.

    ``origin_m`` lies on the joint axis. A positive motion rotates the child link about the unit vector ``axis`` (right-hand
    rule), or translates it along ``axis``. ``lower``, ``upper`` (null: no limit) and ``locked_at`` are in radians, for
    prismatic joints in metres. ``damping`` is in N m s/rad or N s/m, ``friction`` and ``effort`` in N m or N, ``velocity`` in
    rad/s or m/s; ``effort`` and ``velocity`` are limits (null: not stated).
    """

    name: str = Field(min_length=1)
    type: Literal["revolute", "continuous", "prismatic"]
    parent: str = Field(min_length=1)
    child: str = Field(min_length=1)
    origin_m: Vector3
    axis: Vector3
    lower: Finite | None
    upper: Finite | None
    locked_at: Finite
    damping: Annotated[Finite, Field(ge=0)]
    friction: Annotated[Finite, Field(ge=0)]
    effort: Annotated[Finite, Field(ge=0)] | None = None
    velocity: Annotated[Finite, Field(ge=0)] | None = None

    @model_validator(mode="after")
    def _check_limits(self) -> Joint:
        if abs(float(np.linalg.norm(self.axis)) - 1) > _UNIT_TOLERANCE:
            raise ValueError(f"the axis of joint {self.name!r} is not of length one")
        if (self.lower is None) != (self.upper is None) or (self.type == "continuous") != (
            self.type != "prismatic" and self.lower is None
        ):
            raise ValueError(f"joint {self.name!r} has two limits or none, a continuous one none, a revolute one two")
        if self.lower is not None and self.upper is not None and not self.lower <= self.locked_at <= self.upper:
            raise ValueError(f"joint {self.name!r} stands at {self.locked_at}, outside of its limits")
        if not all(abs(place) <= LARGEST_M for place in self.origin_m):
            raise ValueError(f"joint {self.name!r} is farther away than any object is large")
        return self

    def articulated(self, links: Sequence[str]) -> ArticulatedJoint:
        """Return the joint for simulation and rendering; ``links`` are the names of all links in order."""
        # imported here, because it loads mesh libraries that reading a record does not need
        from manitwin.geometry.articulation import ArticulatedJoint

        return ArticulatedJoint(
            name=self.name,
            kind=self.type,
            parent=links.index(self.parent),
            child=links.index(self.child),
            origin_m=np.array(self.origin_m),
            axis=np.array(self.axis),
            lower=self.lower,
            upper=self.upper,
            stands_at=self.locked_at,
            damping=self.damping,
            friction=self.friction,
            effort=self.effort,
            velocity=self.velocity,
        )

    @classmethod
    def of(cls, joint: ArticulatedJoint, links: Sequence[str]) -> Joint:
        """Return the record of a joint; ``links`` are the names of all links in order."""
        return cls(
            name=joint.name,
            type=joint.kind,
            parent=links[joint.parent],
            child=links[joint.child],
            origin_m=joint.origin_m.tolist(),
            axis=joint.axis.tolist(),
            lower=joint.lower,
            upper=joint.upper,
            locked_at=joint.stands_at,
            damping=joint.damping,
            friction=joint.friction,
            effort=joint.effort,
            velocity=joint.velocity,
        )


class Link(Record):
    """A rigid link in the object frame: mass properties, collision hulls, and its number of faces in visual.glb.

    ``source`` is the source of mass, centre of mass and inertia. ``hulls`` are the numbers NN of collision/hull_NN.obj.
    """

    name: str = Field(min_length=1)
    mass_kg: Annotated[Finite, Field(gt=0, le=LARGEST_KG)]
    center_of_mass_m: Vector3
    inertia_kg_m2: Matrix3
    source: str = Field(min_length=1)
    hulls: Annotated[list[Annotated[int, Field(ge=0)]], Field(min_length=1)]
    faces: Annotated[int, Field(ge=1)]


class GivenLink(Record):
    """A link of an imported asset: mass, centre of mass and inertia if it states all three, otherwise none of them.

    The inertia alone is null if it is impossible for the mass.
    """

    name: str = Field(min_length=1)
    mass_kg: Annotated[Finite, Field(gt=0, le=LARGEST_KG)] | None
    center_of_mass_m: Vector3 | None
    inertia_kg_m2: Matrix3 | None


class Articulation(Record):
    """The links and joints of an imported asset; ``link_of_mesh`` is the link of each mesh of its glTF file, in order."""

    links: Annotated[list[GivenLink], Field(min_length=2, max_length=MAX_LINKS)]
    joints: list[Joint]
    link_of_mesh: list[Annotated[int, Field(ge=0)]]

    @model_validator(mode="after")
    def _check_tree(self) -> Articulation:
        require_tree([link.name for link in self.links], self.joints)
        if set(self.link_of_mesh) != set(range(len(self.links))):
            raise ValueError("each link has a mesh, and each mesh is of a link")
        return self

    def moved(self, transform: np.ndarray) -> Articulation:
        """Return the links and joints under a rigid transform ``(4, 4)`` of their frame."""
        names = [link.name for link in self.links]
        joints = [Joint.of(joint.articulated(names).moved(transform), names) for joint in self.joints]
        return self.model_copy(
            update={"joints": joints, "links": [_transform_link(link, transform) for link in self.links]}
        )

    def scaled(self, factor: float) -> Articulation:
        """Return the links and joints with all lengths multiplied by ``factor`` and the same masses."""
        if factor == 1.0:
            return self
        joints = [_scale_joint(joint, factor) for joint in self.joints]
        return self.model_copy(update={"joints": joints, "links": [_scale_link(link, factor) for link in self.links]})


def _transform_link(link: GivenLink, transform: np.ndarray) -> GivenLink:
    if link.center_of_mass_m is None:
        return link
    rotation = transform[:3, :3]
    center = rotation @ link.center_of_mass_m + transform[:3, 3]
    said = link.inertia_kg_m2
    inertia = None if said is None else (rotation @ np.array(said) @ rotation.T).tolist()
    return link.model_copy(update={"center_of_mass_m": center.tolist(), "inertia_kg_m2": inertia})


def require_tree(links: Sequence[str], joints: Sequence[Joint]) -> None:
    """Raise ValueError unless the joints form a tree: the first link is its root, each other link has a parent before it."""
    if len(set(links)) < len(links) or len({joint.name for joint in joints}) < len(joints):
        raise ValueError("links and joints have names of their own")
    for link, joint in zip(links[1:], joints, strict=False):
        if joint.child != link or joint.parent not in links[: links.index(link)]:
            raise ValueError(
                f"joint {joint.name!r} holds no link that comes after its parent: joints are in the links' order"
            )
    if len(joints) != max(len(links) - 1, 0):
        raise ValueError(f"{len(links)} links are held by {len(links) - 1} joints, not by {len(joints)}")


def _scale_link(link: GivenLink, factor: float) -> GivenLink:
    if link.center_of_mass_m is None:
        return link
    said = link.inertia_kg_m2
    inertia = None if said is None else (factor**2 * np.array(said)).tolist()
    center = (factor * np.array(link.center_of_mass_m)).tolist()
    return link.model_copy(update={"center_of_mass_m": center, "inertia_kg_m2": inertia})


def _scale_joint(joint: Joint, factor: float) -> Joint:
    origin = (factor * np.array(joint.origin_m)).tolist()
    if joint.type != "prismatic":
        return joint.model_copy(update={"origin_m": origin})
    ends = {
        name: None if (end := getattr(joint, name)) is None else factor * end
        for name in ("lower", "upper", "locked_at")
    }
    return joint.model_copy(update={"origin_m": origin, **ends})
