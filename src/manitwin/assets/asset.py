"""Object assets as their files describe them, without additions or repairs.

All geometry is in the asset's own axes, in metres according to the unit and scale that the files declare. Values that the files
do not state are None or empty. Values that they state wrongly are kept unchanged, so that an audit can find them.
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
    """One collision geometry: ``vertices (V, 3)`` in metres and ``faces (F, 3)``; a primitive is given as a mesh.

    ``convex``: the simulator uses the convex hull of the vertices and ignores the faces. ``primitive``: the format declares a
    box, sphere or similar solid. ``groups``: vertices and faces of each group that the file separates, where there is more than
    one. ``as_drawn``: the file asks for the triangles themselves, for example as a signed distance field.
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
    """Surface properties as declared; ``material`` is the name of the material.

    ``of_others``: this body declares no friction, but bodies of the same file that were left out do. ``friction_range`` is the
    smallest and largest friction of the body's surfaces, where they differ.
    """

    friction_static: float | None = None
    friction_dynamic: float | None = None
    restitution: float | None = None
    material: str | None = None
    of_others: bool = False
    friction_range: tuple[float, float] | None = None


@dataclass(frozen=True)
class AnnotatedFrame:
    """An annotated frame: ``frame_to_asset (4, 4)`` as written, with its translation in metres.

    A grasp frame also has ``approach (3,)`` and ``closing (3,)``, unit vectors in the asset's axes; its origin is the point
    between the fingertips.
    """

    kind: FrameKind
    number: int
    frame_to_asset: np.ndarray
    label: str = ""
    approach: np.ndarray | None = None
    closing: np.ndarray | None = None


@dataclass(frozen=True)
class AnnotatedGrasps:
    """Grasps of one gripper, in the grasp frame of twins.

    ``gripper_to_asset (N, 4, 4)`` are poses, ``depth_m (N,)`` and ``width_m (N,)`` depths and opening widths in metres.
    ``held (N,)`` says whether the source of the annotation reports that the grasp held.
    """

    gripper: str
    gripper_to_asset: np.ndarray
    depth_m: np.ndarray
    width_m: np.ndarray
    held: np.ndarray


@dataclass(frozen=True)
class Asset:
    """One object asset.

    - ``path``: the file or folder that was given; ``files``: all files that belong to it, sorted.
    - ``up``: the vertical axis, by the rule of the format or as declared by the file.
    - ``unit_m``: the length of the file's unit in metres, None if it declares none.
    - ``missing_files``: files that are named and do not exist.
    - ``remarks``: what the reader noted, one line each; ``lenient``: the remarks on content that a strict loader would refuse
      or not find.
    - ``joints``: all joints of the file, including those of bodies that were left out.
    - ``rests``: declared resting poses, asset to support plane ``(4, 4)``.
    - ``static``: the file declares the asset immovable, as buildings are.
    - ``partial``: other bodies of the file, such as the links of a robot, were left out; ``name`` is that of the whole file.
    - ``soft``: the body deforms, so checks for rigid bodies do not apply.
    - ``articulation``: the links that were read and the joints between them; all other fields describe the links together, in
      the pose of the file.
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
    """Combine rigidly joined bodies, all with mass, into one by the parallel axis theorem.

    The result has no centre where a centre is unknown or the total mass is 0, and no inertia tensor where one is unknown.
    """
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
