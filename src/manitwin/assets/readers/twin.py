"""Reader of a finished twin as an asset."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from manitwin.assets.asset import AnnotatedFrame, AnnotatedGrasps, Asset, CollisionShape, Contact, Inertial
from manitwin.assets.asset_files import MESH_LIMITS, concatenate_meshes
from manitwin.assets.joints import DeclaredJoint
from manitwin.errors import AssetError, InputError, TwinError
from manitwin.formats.glb import read_glb
from manitwin.formats.meshes.obj import read_obj
from manitwin.formats.meshes.source import MeshSource
from manitwin.geometry.poses import rotation_between, rotation_from_quaternion_wxyz, transform
from manitwin.twin.grasp_summary import GraspSummary
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.point_records import FunctionalPoint, GraspPoint


def read(path: Path) -> Asset:
    """Read the folder of an accepted twin, or its twin.json.

    The frame of a point has its Z axis along the outward normal. ``rests`` are the placements. Raises AssetError for an
    unreadable folder and for a rejected twin.
    """
    folder = path.parent if path.is_file() else path
    try:
        twin = Twin(folder)
        record, physical = twin.record, twin.physical
        # digests identify the textures of a twin; decoding their pixels would take a sixth of the reading time
        visual = tuple(read_glb(folder / "visual.glb", limits=replace(MESH_LIMITS, decode_textures=False)))
        grasps = _grasps(twin)
    except (TwinError, InputError) as error:
        raise AssetError(str(error)) from error
    except OSError as error:
        raise AssetError(
            f"{folder}: {error.filename or ''} {error.strerror or error}; the twin is incomplete"
        ) from error
    language, points = record.language, record.points
    return Asset(
        format="twin",
        path=path,
        name=record.name or (language.category if language else record.twin_id),
        visual=visual,
        collision=_hulls(folder),
        up="z",
        unit_m=1.0,
        inertial=Inertial(
            physical.mass_kg.value, np.array(physical.center_of_mass_m), np.array(physical.inertia_kg_m2)
        ),
        contact=Contact(
            physical.friction_static.value,
            physical.friction_dynamic.value,
            physical.restitution.value,
            physical.material,
        ),
        category=language.category if language else None,
        captions=tuple(dict.fromkeys([language.caption, *language.captions])) if language else (),
        frames=tuple(_frames(points.functional, points.grasp)) if points else (),
        grasps=grasps,
        rests=tuple(
            transform(rotation_from_quaternion_wxyz(np.array(p.quaternion_wxyz)), np.array(p.position_m))
            for p in record.placements or []
        ),
        license=None if record.source.license == "unknown" else record.source.license,
        attribution=record.source.attribution,
        files=tuple(sorted(folder / name for name in (*record.files, "twin.json") if (folder / name).is_file())),
        missing_files=tuple(sorted(name for name in record.files if not (folder / name).is_file())),
        joints=tuple(
            DeclaredJoint(
                joint.name, joint.type, joint.parent, joint.child, np.array(joint.axis), joint.lower, joint.upper
            )
            for joint in record.joints
        ),
    )


def _hulls(folder: Path) -> tuple[CollisionShape, ...]:
    shapes = []
    for file in sorted((folder / "collision").glob("hull_*.obj")):
        try:
            vertices, faces = concatenate_meshes(read_obj(MeshSource(file, MESH_LIMITS)))
        except InputError as error:
            raise AssetError(error.detail) from error
        shapes.append(CollisionShape(file.stem, vertices, faces, convex=True, file=file))
    return tuple(shapes)


def _frames(functional: list[FunctionalPoint], grasp: list[GraspPoint]) -> list[AnnotatedFrame]:
    frames = [
        AnnotatedFrame("functional", i, _frame(p.position_m, p.normal), p.label or p.description)
        for i, p in enumerate(functional)
    ]
    return frames + [
        AnnotatedFrame("contact", i, _frame(p.position_m, p.normal), p.type.replace("_", " "))
        for i, p in enumerate(grasp)
    ]


def _frame(position_m: list[float], normal: list[float]) -> np.ndarray:
    if np.linalg.norm(normal) < 1e-9:
        raise AssetError(f"a point at {position_m} has no normal")
    return transform(rotation_between(np.array([0.0, 0, 1]), np.array(normal)), np.array(position_m))


def _grasps(twin: Twin) -> tuple[AnnotatedGrasps, ...]:
    summaries: list[GraspSummary] = [] if twin.record.grasps is None else [twin.record.grasps]
    if summaries:
        others = (other.summary for other in summaries[0].other_grippers.values())
        summaries += [summary for summary in others if summary is not None]
    found = []
    for summary in summaries:
        grasps = twin.grasps(verified_only=False, gripper=summary.gripper, retired=True)
        found.append(
            AnnotatedGrasps(
                summary.gripper, grasps.gripper_to_object, grasps.depth_m, grasps.width_m, held=grasps.verified
            )
        )
    return tuple(found)
