"""An object asset as some tool ships it: what its files say, nothing added and nothing mended.

All geometry is in the asset's own axes, in metres by the unit and scale that the files declare. What the files do not say is
None or empty; what they say wrongly is kept as it stands.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
import trimesh

from manitwin.assets.articulation import Articulation
from manitwin.assets.inertial import Inertial
from manitwin.assets.joints import DeclaredJoint

Format = Literal["twin", "urdf", "mjcf", "sdf", "usd", "robotwin", "manitwin100k", "embodiedgen", "gso"]
FrameKind = Literal["contact", "functional", "target", "orientation"]


@dataclass(frozen=True)
class CollisionShape:
    """One collision geometry: ``vertices (V, 3)`` m and ``faces (F, 3)``; primitives come as their meshes.

    ``convex``: the simulator takes its convex hull, whatever the faces say. ``primitive``: it is a box, sphere or the like by its
    format. ``groups`` are vertices and faces of what its file keeps apart, where that is more than one.
    ``as_drawn``: the file asks for the triangles themselves, as a distance field, say.
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    convex: bool
    file: Path | None = None
    primitive: bool = False
    groups: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    as_drawn: bool = False


@dataclass(frozen=True)
class Contact:
    """Surface properties as declared; ``material`` is a word for it.

    ``of_others``: bodies of the file that were left out declare a friction, and this one does not. ``friction_range`` is the
    least and the most of its surfaces, where they differ.
    """

    friction_static: float | None = None
    friction_dynamic: float | None = None
    restitution: float | None = None
    material: str | None = None
    of_others: bool = False
    friction_range: tuple[float, float] | None = None


@dataclass(frozen=True)
class AnnotatedFrame:
    """A frame that somebody annotated: ``frame_to_asset (4, 4)`` as written, but with its translation in metres.

    ``approach (3,)`` and ``closing (3,)`` are unit vectors in the asset's axes for frames that say how to grasp; the point
    between the fingertips is the frame's origin.
    """

    kind: FrameKind
    number: int
    frame_to_asset: np.ndarray
    label: str = ""
    approach: np.ndarray | None = None
    closing: np.ndarray | None = None


@dataclass(frozen=True)
class AnnotatedGrasps:
    """Grasps of one gripper in the grasp frame of twins: ``gripper_to_asset (N, 4, 4)``, ``depth_m (N,)``, ``width_m (N,)``.

    ``held (N,)``: what whoever made them says of each.
    """

    gripper: str
    gripper_to_asset: np.ndarray
    depth_m: np.ndarray
    width_m: np.ndarray
    held: np.ndarray


@dataclass(frozen=True)
class Asset:
    """One asset; ``path`` is the file or folder that was given, ``files`` all that belong to it, sorted.

    ``up`` is the axis that stands up by the format's rule or the file's word; ``unit_m`` the length of a file's unit, None
    where it declares none. ``missing_files`` are named and not there; ``remarks`` are what the reader had to note, one line
    each; ``lenient`` those of them that a loader which goes by the letter of the format would refuse, or not find. ``joints``
    are all of the file, those of bodies that were left out too. ``rests`` are declared resting poses, asset to plane ``(4,
    4)``. ``static``: it is said to stand fast, as buildings do, and is no object that moves. ``partial``: other bodies of the
    file, such as a robot's links, were left out; its name is of them all. ``soft``: it deforms; what is asked of rigid bodies
    is not asked of it. ``articulation``: the links that were read with the joints between them; the rest of the asset is of all
    of them as they stand.
    """

    format: Format
    path: Path
    name: str
    visual: tuple[trimesh.Trimesh, ...]
    collision: tuple[CollisionShape, ...]
    up: Literal["y", "z"]
    unit_m: float | None
    inertial: Inertial = field(default_factory=Inertial)
    contact: Contact = Contact()
    category: str | None = None
    captions: tuple[str, ...] = ()
    frames: tuple[AnnotatedFrame, ...] = ()
    grasps: tuple[AnnotatedGrasps, ...] = ()
    rests: tuple[np.ndarray, ...] = ()
    static: bool = False
    partial: bool = False
    soft: bool = False
    license: str | None = None
    attribution: str | None = None
    files: tuple[Path, ...] = ()
    missing_files: tuple[str, ...] = ()
    remarks: tuple[str, ...] = field(default=())
    lenient: tuple[str, ...] = ()
    joints: tuple[DeclaredJoint, ...] = ()
    articulation: Articulation | None = None


def combined_inertial(bodies: list[Inertial]) -> Inertial:
    """Return rigidly joined bodies, all with mass and centre, as one (the parallel axis theorem)."""
    if len(bodies) == 1:
        return bodies[0]
    masses = np.array([body.mass_kg for body in bodies], float)
    total = float(masses.sum())
    centers = [body.center_of_mass_m for body in bodies]
    if total == 0 or any(center is None for center in centers):
        return Inertial(total)
    points = np.array(centers, float)
    center = masses @ points / total
    if any(body.inertia_kg_m2 is None for body in bodies):
        return Inertial(total, center)
    offsets = points - center
    moved = [
        np.asarray(body.inertia_kg_m2) + mass * ((offset @ offset) * np.eye(3) - np.outer(offset, offset))
        for body, mass, offset in zip(bodies, masses, offsets, strict=True)
    ]
    return Inertial(total, center, np.sum(moved, axis=0))
