"""A mug that nothing is wrong with: as an asset in memory, as a URDF and as a twin; and the ways to break it."""

from __future__ import annotations

import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from handmade import mug
from manitwin.assets.asset import AnnotatedFrame, AnnotatedGrasps, Asset, CollisionShape, Contact, Inertial
from manitwin.formats.glb import write_glb
from manitwin.geometry.cavity import find_opening
from manitwin.geometry.hulls.decomposition import convex_decomposition
from manitwin.geometry.hulls.reduction import hull_mesh, hull_to_obj
from manitwin.geometry.mass_properties import solid_mass_properties
from manitwin.geometry.poses import quaternion_wxyz, transform
from manitwin.twin.grasp_table import SCHEMA
from manitwin.twin.store import RECORD, parse_record, write_twin_record
from record_overlay import overlaid
from twin_folders import write_accepted

MASS_KG = 0.3
DEPTH_M = 0.1034


@cache
def solid() -> trimesh.Trimesh:
    """The closed mesh: 80 mm wide, 100 mm high, a handle towards +x."""
    return mug()


@cache
def hulls() -> tuple[np.ndarray, ...]:
    """Its convex pieces."""
    found = convex_decomposition(solid(), max_hulls=32, max_vertices=64, oversplit=1.5, opening=find_opening(solid()))
    return found.hulls


def shape(name: str, vertices: np.ndarray) -> CollisionShape:
    """A convex collision shape."""
    return CollisionShape(name, vertices, np.asarray(hull_mesh(vertices).faces), convex=True)


def textured(mesh: trimesh.Trimesh, width: int = 64, height: int = 64) -> trimesh.Trimesh:
    """The mesh with a texture of so many pixels."""
    part = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    picture = Image.new("RGB", (width, height), (200, 180, 160))
    material = PBRMaterial(
        baseColorTexture=picture, baseColorFactor=[255, 255, 255, 255], metallicFactor=0.0, roughnessFactor=0.8
    )
    part.visual = TextureVisuals(uv=np.zeros((len(part.vertices), 2)), material=material)
    part.metadata["name"] = "mug"
    return part


def frame(z: np.ndarray, x: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """A frame by two of its axes."""
    return transform(np.column_stack([x, np.cross(z, x), z]), origin)


def contact(
    number: int, point: tuple[float, ...], approach: tuple[float, ...], closing: tuple[float, ...]
) -> AnnotatedFrame:
    """A contact frame whose Z is the approach and X the closing direction."""
    toward, across, origin = (np.array(v, float) for v in (approach, closing, point))
    return AnnotatedFrame("contact", number, frame(toward, across, origin), "", toward, across)


def rim_grasps(count: int = 8) -> np.ndarray:
    """Grasps of the rim from above, all around: ``gripper_to_asset (N, 4, 4)``."""
    poses = []
    for angle in 2 * np.pi * (np.arange(count) + 0.5) / count:
        outward = np.array([np.cos(angle), np.sin(angle), 0])
        tip = 0.0385 * outward + [0, 0, 0.095]
        poses.append(frame(np.array([0, 0, -1.0]), outward, tip + np.array([0, 0, DEPTH_M])))
    return np.array(poses)


def clean() -> Asset:
    """The mug as an asset of which everything is said, truly."""
    body = solid_mass_properties(solid(), MASS_KG)
    poses = rim_grasps()
    return Asset(
        format="urdf",
        path=Path("mug.urdf"),
        name="mug",
        visual=(textured(solid()),),
        collision=tuple(shape(f"hull_{i:02d}", hull) for i, hull in enumerate(hulls())),
        up="z",
        unit_m=1.0,
        inertial=Inertial(MASS_KG, body.center_of_mass_m, body.inertia_kg_m2),
        contact=Contact(0.45, 0.36, 0.3, "ceramic"),
        category="mug",
        captions=("A mug.",),
        frames=(
            contact(0, (-0.0385, 0, 0.095), (0, 0, -1), (1, 0, 0)),
            contact(1, (0.07, 0, 0.05), (-1, 0, 0), (0, 1, 0)),
            AnnotatedFrame("functional", 0, transform(translation=np.array([0, 0, 0.1]))),
        ),
        grasps=(
            AnnotatedGrasps(
                "panda", poses, np.full(len(poses), DEPTH_M), np.full(len(poses), 0.003), np.ones(len(poses), bool)
            ),
        ),
        rests=(np.eye(4),),
        license="CC0-1.0",
        attribution="Ada",
    )


def scaled(asset: Asset, factor: float) -> Asset:
    """The asset with every length multiplied and all else as it stands."""
    return mapped(asset, lambda points: points * factor)


def moved(asset: Asset, offset_m: np.ndarray) -> Asset:
    """The asset with its origin elsewhere, all geometry and annotations along."""
    return mapped(asset, lambda points: points + offset_m)


def mapped(asset: Asset, change: Any) -> Asset:
    """The asset with a map applied to all points of it."""

    def with_origin(pose: np.ndarray) -> np.ndarray:
        return transform(pose[:3, :3], change(pose[:3, 3]))

    parts = []
    for part in asset.visual:
        copy = part.copy()
        copy.vertices = change(np.asarray(part.vertices))
        parts.append(copy)
    center = asset.inertial.center_of_mass_m
    return replace(
        asset,
        visual=tuple(parts),
        collision=tuple(replace(each, vertices=change(each.vertices)) for each in asset.collision),
        inertial=replace(asset.inertial, center_of_mass_m=None if center is None else change(center)),
        frames=tuple(replace(each, frame_to_asset=with_origin(each.frame_to_asset)) for each in asset.frames),
        grasps=tuple(
            replace(each, gripper_to_asset=np.array([with_origin(pose) for pose in each.gripper_to_asset]))
            for each in asset.grasps
        ),
    )


def write_urdf(folder: Path, *, inertial: str | None = None) -> Path:
    """Write the mug as a URDF with its meshes; ``inertial`` is the element's text, all of it said where None."""
    folder.mkdir(parents=True, exist_ok=True)
    body = solid_mass_properties(solid(), MASS_KG)
    if inertial is None:
        origin = " ".join(map(repr, body.center_of_mass_m.tolist()))
        names = (("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2))
        tensor = " ".join(f'{n}="{float(body.inertia_kg_m2[r, c])!r}"' for n, r, c in names)
        inertial = f'<origin xyz="{origin}" rpy="0 0 0"/><mass value="{MASS_KG}"/><inertia {tensor}/>'
    for i, hull in enumerate(hulls()):
        (folder / f"hull_{i:02d}.obj").write_bytes(hull_to_obj(hull))
    vertices = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in solid().vertices.tolist())
    faces = "".join(f"f {a} {b} {c}\n" for a, b, c in (solid().faces + 1).tolist())
    (folder / "mug.obj").write_text(vertices + faces)
    pieces = "".join(
        f'<collision><geometry><mesh filename="hull_{i:02d}.obj"/></geometry></collision>' for i in range(len(hulls()))
    )
    (folder / "mug.urdf").write_text(
        '<?xml version="1.0"?>\n<!-- license: CC0-1.0 -->\n<robot name="mug"><link name="mug">\n'
        f"<inertial>{inertial}</inertial>\n"
        f'<visual><geometry><mesh filename="mug.obj"/></geometry></visual>\n{pieces}\n'
        '<contact><lateral_friction value="0.45"/></contact>\n</link></robot>\n'
    )
    return folder / "mug.urdf"


def write_twin(root: Path, changes: dict[str, Any] | None = None) -> Path:
    """Write the mug as an accepted twin and return its folder; ``changes`` are laid over its record."""
    identity = write_accepted(root, 0, mesh=solid())
    folder = next(path.parent for path in root.rglob(RECORD) if path.parent.name == identity)
    shutil.rmtree(folder / "collision", ignore_errors=True)
    (folder / "collision").mkdir()
    for i, hull in enumerate(hulls()):
        (folder / "collision" / f"hull_{i:02d}.obj").write_bytes(hull_to_obj(hull))
    (folder / "visual.glb").write_bytes(write_glb([textured(solid())]))
    poses = rim_grasps()
    columns: dict[str, list[Any]] = {name: [None] * len(poses) for name in SCHEMA.names}
    columns |= {
        "grasp_id": [f"panda-{i:04d}" for i in range(len(poses))],
        "gripper": ["panda"] * len(poses),
        "position_m": poses[:, :3, 3].tolist(),
        "quaternion_wxyz": quaternion_wxyz(poses[:, :3, :3]).tolist(),
        "width_m": [0.003] * len(poses),
        "depth_m": [DEPTH_M] * len(poses),
        "score": [1.0] * len(poses),
        "proposer": ["antipodal"] * len(poses),
        "outcome": ["held"] * len(poses),
        "verified": [True] * len(poses),
        "retired": [False] * len(poses),
    }
    pq.write_table(pa.table(columns, schema=SCHEMA), folder / "grasps.parquet")
    body = solid_mass_properties(solid(), MASS_KG)
    on_rim = {"position_m": [-0.0385, 0.0, 0.1], "normal": [0.0, 0.0, 1.0], "confidence": 0.5, "rationale": "so"}
    record = parse_record((folder / RECORD).read_bytes()).model_dump(mode="json")
    mass = {"value": MASS_KG, "low": 0.2, "high": 0.4, "source": "user"}
    said = {
        "physical": {
            "mass_kg": mass,
            "center_of_mass_m": body.center_of_mass_m.tolist(),
            "inertia_kg_m2": body.inertia_kg_m2.tolist(),
        },
        "points": {
            "candidates": {
                "positions_m": solid().vertices[::50].tolist(),
                "normals": solid().vertex_normals[::50].tolist(),
            },
            "functional": [{"id": "f0", "candidate": 0, "label": "rim", "description": "a rim", **on_rim}],
            "grasp": [{"id": "g0", "candidate": 0, "type": "pinch", "scenario": "lift", **on_rim}],
        },
    }
    sealed = overlaid(overlaid(record, said), changes or {})
    del sealed["revision"]
    write_twin_record(folder, sealed)
    return folder
