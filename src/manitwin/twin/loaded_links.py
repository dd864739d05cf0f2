"""The links of a finished twin: visual meshes per link, rigid bodies with joints, and visual meshes at given joint positions."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import trimesh

from manitwin.errors import TwinError, UsageError, unknown_name_message
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.meshes.textures import bake_transform, make_part, material_of, normals_of, uv_of
from manitwin.formats.npy_file import MAX_LABEL_BYTES, parse_labels
from manitwin.geometry.articulation import ArticulatedBody, ArticulatedJoint, link_motions
from manitwin.geometry.rigid_body import RigidBody
from manitwin.twin.link_records import FACE_LINKS
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import REMEDY


def read_face_links(folder: Path, record: TwinRecord, faces: int) -> np.ndarray:
    """Return the index in ``record.links`` of the link of each face ``(F,) uint8``; 0 for a twin without links.

    Raises TwinError if the file has another number of faces or refers to links that the record does not have.
    """
    if not record.links:
        return np.zeros(faces, np.uint8)
    path = folder / FACE_LINKS
    content = read_bytes(path, MAX_LABEL_BYTES, TwinError, inside=folder, name=str(path))
    labels = parse_labels(content, str(path), TwinError, remedy=REMEDY)
    if len(labels) != faces:
        raise TwinError(f"{path}: has links for {len(labels)} faces, but visual.glb has {faces}; {REMEDY}")
    if len(labels) and labels.max() >= len(record.links):
        raise TwinError(f"{path}: refers to link {labels.max()}, but the record has {len(record.links)}; {REMEDY}")
    return labels


def joints_of(record: TwinRecord) -> tuple[ArticulatedJoint, ...]:
    """Return the joints of a twin in the order of its links; empty for a rigid twin."""
    names = [link.name for link in record.links]
    return tuple(joint.articulated(names) for joint in record.joints)


def articulated_body(record: TwinRecord, whole: RigidBody) -> ArticulatedBody:
    """Return the links as rigid bodies with their joints; ``whole`` is the twin with locked joints.

    A twin without links is a single body. Raises TwinError if the record refers to hulls that do not exist.
    """
    if not record.links:
        return ArticulatedBody((whole,), ())
    missing = {number for link in record.links for number in link.hulls} - set(range(len(whole.hulls)))
    if missing:
        raise TwinError(f"{record.twin_id}: its links refer to hull_{min(missing):02d}, which is not there; {REMEDY}")
    links = tuple(
        RigidBody(
            hulls=tuple(whole.hulls[number] for number in link.hulls),
            mass_kg=link.mass_kg,
            center_of_mass_m=np.array(link.center_of_mass_m),
            inertia_kg_m2=np.array(link.inertia_kg_m2),
            friction_static=whole.friction_static,
            friction_dynamic=whole.friction_dynamic,
        )
        for link in record.links
    )
    return ArticulatedBody(links, joints_of(record))


def parts_by_link(parts: list[trimesh.Trimesh], labels: np.ndarray, count: int) -> list[list[trimesh.Trimesh]]:
    """Return the visual parts of each of ``count`` links; ``labels (F,)`` are the links of the faces of all parts in order."""
    found: list[list[trimesh.Trimesh]] = [[] for _ in range(count)]
    ends = np.cumsum([len(part.faces) for part in parts])[:-1]
    for part, own in zip(parts, np.split(labels, ends), strict=True):
        for link in np.unique(own):
            found[link].append(part if (own == link).all() else _with_faces(part, own == link))
    return found


def posed_parts(
    parts: list[trimesh.Trimesh],
    labels: np.ndarray,
    joints: tuple[ArticulatedJoint, ...],
    positions: Mapping[str, float],
) -> list[trimesh.Trimesh]:
    """Return the visual parts with the named joints at ``positions``, other joints unchanged; the root link does not move.

    Raises UsageError for an unknown joint or a position outside its limits.
    """
    wanted = [joint.stands_at for joint in joints]
    names = [joint.name for joint in joints]
    for name, position in positions.items():
        if name not in names:
            raise UsageError(
                unknown_name_message("joint", name, names) if names else "the twin has no joints: it is one rigid body"
            )
        joint = joints[names.index(name)]
        if joint.within(position) != position:
            unit = "m" if joint.kind == "prismatic" else "rad"
            limits = f"{joint.lower:.4g} to {joint.upper:.4g} {unit}"
            raise UsageError(f"joint {name}: {position:g} {unit} is outside of its limits, {limits}")
        wanted[names.index(name)] = position
    motions = link_motions(joints, wanted)
    by_link = parts_by_link(parts, labels, len(motions))
    return [bake_transform(part, motion) for some, motion in zip(by_link, motions, strict=True) for part in some]


def _with_faces(part: trimesh.Trimesh, keep: np.ndarray) -> trimesh.Trimesh:
    faces = np.asarray(part.faces)[keep]
    used, inverse = np.unique(faces, return_inverse=True)
    uv, normals = uv_of(part), normals_of(part)
    return make_part(
        part.vertices[used],
        inverse.reshape(-1, 3),
        material=material_of(part),
        name=str(part.metadata["name"]),
        uv=None if uv is None else uv[used],
        normals=None if normals is None else normals[used],
    )
