"""Assets of other tools, written by hand: small, of known numbers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image

from handmade import mug, visual
from manitwin.formats.glb import write_glb
from manitwin.twin.import_record import ImportRecord


def mug_urdf(folder: Path, *, mass_kg: float | None = 0.32, name: str = "mug") -> Path:
    """A mug whose mesh is Y-up and turned by the visual's origin, with PyBullet's friction and its licence stated."""
    folder.mkdir(parents=True, exist_ok=True)
    mesh = mug()
    turned = trimesh.Trimesh(
        np.column_stack([mesh.vertices[:, 0], mesh.vertices[:, 2], -mesh.vertices[:, 1]]), mesh.faces
    )
    turned.export(folder / "mug.stl")
    shape = '<origin xyz="0.5 0 0.2" rpy="1.5707963267948966 0 0"/><geometry><mesh filename="mug.stl"/></geometry>'
    inertial = (
        ""
        if mass_kg is None
        else f'<inertial><origin xyz="0.505 0 0.245"/><mass value="{mass_kg}"/>'
        '<inertia ixx="5e-4" ixy="0" ixz="0" iyy="5e-4" iyz="0" izz="4e-4"/></inertial>'
    )
    path = folder / f"{name}.urdf"
    path.write_text(
        f'<?xml version="1.0"?><!-- license: CC0-1.0 --><robot name="{name}"><link name="base">{inertial}'
        f'<visual>{shape}</visual><collision>{shape}</collision><contact><lateral_friction value="0.55"/></contact>'
        "</link></robot>"
    )
    return path


def manitwin100k(folder: Path, *, place_off_m: float = 0.0, annotations: dict[str, Any] | None = None) -> Path:
    """An instance of ManiTwin-100K: a mug whose annotations are in the axes of its glTF, Y up."""
    folder.mkdir(parents=True, exist_ok=True)
    mesh = mug()
    (folder / "base_rescaled.glb").write_bytes(write_glb([visual(mesh, baseColorFactor=[200, 20, 20, 255])]))
    low, high = mesh.bounds
    content: dict[str, Any] = {
        "bounding_box": {
            "min_bounds": [low[0], low[2], -high[1]],
            "max_bounds": [high[0], high[2], -low[1]],
        },
        "active": {
            "place": {
                "id_0": {
                    "position": [0.0, place_off_m, 0.0],
                    "rotation": [0.0, 1.0, 0.0],
                    "face": "-y",
                    "dimensions": [0.1, 0.1, 0.1],
                }
            }
        },
    }
    (folder / "manipulation_annotations.json").write_text(json.dumps(content | (annotations or {})))
    (folder / "caption.json").write_text(json.dumps({"caption": "a red mug with one round handle"}))
    return folder


def gso(folder: Path) -> Path:
    """A scanned object: its material names a texture that lies in materials/textures."""
    (folder / "meshes").mkdir(parents=True)
    (folder / "materials" / "textures").mkdir(parents=True)
    box = trimesh.creation.box([0.1, 0.2, 0.3])
    lines = ["mtllib model.mtl", "usemtl m", *(f"v {x} {y} {z + 0.15}" for x, y, z in box.vertices), "vt 0 0", "vt 1 1"]
    lines += ["f " + " ".join(f"{i + 1}/{i % 2 + 1}" for i in face) for face in box.faces]
    (folder / "meshes" / "model.obj").write_text("\n".join(lines))
    (folder / "meshes" / "model.mtl").write_text("newmtl m\nmap_Kd texture.png\n")
    Image.new("RGB", (8, 8), (1, 150, 30)).save(folder / "materials" / "textures" / "texture.png")
    (folder / "model.config").write_text("<?xml version='1.0'?><model><name>Tall_Box</name></model>")
    (folder / "metadata.pbtxt").write_text('name: "Tall_Box"\ncategories {\n  first: "Bottles and Cans"\n}\n')
    mesh = "<geometry><mesh><uri>meshes/model.obj</uri></mesh></geometry>"
    (folder / "model.sdf").write_text(
        f"<?xml version='1.0'?><sdf version='1.6'><model name='Tall_Box'><link name='l'><visual name='v'>{mesh}</visual>"
        f"<collision name='c'>{mesh}</collision></link></model></sdf>"
    )
    return folder


def embodiedgen(folder: Path, *, turned: bool = True, failed: bool = False) -> Path:
    """EmbodiedGen's result: a mug 0.1 m high, of 0.25 to 0.35 kg; with ``failed``, what it writes without an answer."""
    (folder / "result" / "mesh").mkdir(parents=True)
    mesh = mug()
    turned_mesh = np.column_stack([mesh.vertices[:, 0], mesh.vertices[:, 2], -mesh.vertices[:, 1]])
    trimesh.Trimesh(turned_mesh, mesh.faces).export(folder / "result" / "mesh" / "mug.obj", include_normals=False)
    origin = '<origin xyz="0 0 0" rpy="1.5708 0 0"/>' if turned else ""
    shape = f'{origin}<geometry><mesh filename="mesh/mug.obj" scale="1.0 1.0 1.0"/></geometry>'
    low, high, height = (1, 1, 1) if failed else (0.25, 0.35, 0.1)
    (folder / "result" / "mug.urdf").write_text(
        f"""<?xml version='1.0' encoding='utf-8'?>
<robot name="mug"><link name="mug"><visual>{shape}</visual>
<collision>{shape}<gazebo><mu1>0.70</mu1><mu2>0.50</mu2></gazebo></collision>
<inertial><mass value="{(low + high) / 2:.4f}"/><origin xyz="0 0 0"/>
<inertia ixx="1.0" ixy="0.0" ixz="0.0" iyy="1.0" iyz="0.0" izz="1.0"/></inertial>
<extra_info><scale>1.0</scale><category>mug</category><description>a mug with one handle</description>
<min_height>{height}</min_height><max_height>{height}</max_height><real_height>{height}</real_height>
<min_mass>{low}</min_mass><max_mass>{high}</max_mass></extra_info></link>
<custom_data><quality><MeshGeoChecker>YES</MeshGeoChecker></quality></custom_data></robot>"""
    )
    return folder


def given_record(**given: Any) -> ImportRecord:
    """An import record of a RoboTwin asset that gives only what is said."""
    lists = ("captions", "functional_points", "grasp_points", "grasps", "rests", "missing", "remarks", "dropped")
    nothing: dict[str, Any] = {name: [] if name in lists else None for name in ImportRecord.model_fields}
    named = {"import_version": 1, "format": "robotwin", "file": "x", "name": "x", "asset_to_object": np.eye(4).tolist()}
    return ImportRecord.model_validate(nothing | named | given)
