"""Export of a layout as an SDFormat world: each object a model with its pose, the furniture a static model, meshes beside it.

Follows the specification (sdformat.org/spec, version 1.9). Models are inline, because included models are looked up on a
resource path.
"""

from __future__ import annotations

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.writers import sdf
from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.mesh_files import VisualPart, hull_files, visual_parts
from manitwin.formats.xml_file import add, document, new_element, number_text
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.geometry.rigid_body import FURNITURE_FRICTION
from manitwin.physics.trial import GRAVITY_M_S2
from manitwin.robots.urdf import roll_pitch_yaw
from manitwin.scenes.loaded_scene import Scene
from manitwin.scenes.sapien_scene import PLAIN_COLORS
from manitwin.scenes.scene import SurfaceBox

MAIN = "scene.sdf"
TWINS = "twins"
FURNITURE = "furniture"


def export_sdf(scene: Scene) -> Exported:
    """Return the scene as a world with its twins' meshes; models have the names of the scene's objects.

    An articulated twin becomes one rigid body in its present pose. Raises ExportError for a twin that SDFormat cannot
    represent.
    """
    record = scene.record
    root = new_element("sdf", version=sdf.VERSION)
    world = add(root, "world", name=record.scene_id)
    add(world, "gravity", number_text(0, 0, -GRAVITY_M_S2))
    for number, light in enumerate(record.lights):
        element = add(world, "light", name=f"light_{number}", type="directional")
        add(element, "cast_shadows", str(light.casts_shadow).lower())
        add(element, "diffuse", number_text(*(min(1.0, c / 2) for c in light.color), 1.0))
        add(element, "direction", number_text(*light.direction))
    _add_furniture(world, record.furniture.boxes)
    files: dict[str, bytes] = {}
    known: dict[str, tuple[TwinContent, tuple[VisualPart, ...], dict[str, bytes]]] = {}
    for placed in record.objects:
        if placed.twin_id not in known:
            content = TwinContent.of(scene.twin(placed.twin_id))
            meshes = f"{TWINS}/{content.name}"
            known[placed.twin_id] = content, visual_parts(content, meshes), hull_files(content, meshes)
        content, parts, hulls = known[placed.twin_id]
        for part in parts:
            files |= part.files
        files |= hulls
        model = add(world, "model", name=placed.name)
        turn = rotation_from_quaternion_wxyz(np.array(placed.quaternion_wxyz))
        add(model, "pose", number_text(*placed.position_m, *roll_pitch_yaw(turn)))
        sdf.add_body(model, content, parts, hulls)
    files[MAIN] = document(
        root, [f"layout {record.scene_id}: {len(record.objects)} objects on a {record.furniture.kind}"]
    )
    said = ["cameras: a sensor asks for a plugin, whose name differs between Gazebo's versions; scene.json has them."]
    locked = sorted(content.name for content, _, _ in known.values() if content.record.joints)
    if locked:
        said.append(f"the joints of {', '.join(locked)}: each is one rigid body as the twin stands.")
    said.append("dynamic friction: mu and mu2 are the static coefficient in two directions.")
    return Exported(files=files, main=MAIN, cannot_say=(*said, *sdf.CANNOT_SAY))


def _add_furniture(world: etree._Element, boxes: tuple[SurfaceBox, ...]) -> None:
    model = add(world, "model", name=FURNITURE)
    add(model, "static", "true")
    link = add(model, "link", name=FURNITURE)
    for box in boxes:
        color = number_text(*PLAIN_COLORS[box.material], 1.0)
        for tag in ("visual", "collision"):
            element = add(link, tag, name=box.name)
            add(element, "pose", f"{number_text(*box.center_m)} 0 0 0")
            size = number_text(*(2 * half for half in box.half_extents_m))
            add(add(add(element, "geometry"), "box"), "size", size)
            if tag == "collision":
                sdf.add_friction(element, FURNITURE_FRICTION)
            else:
                material = add(element, "material")
                for shade in ("ambient", "diffuse"):
                    add(material, shade, color)
