"""Export of a layout as an MJCF folder: a scene file that attaches the exports of its twins, each stored once.

Source: MuJoCo XML reference, ``asset/model`` and ``attach``.
"""

from __future__ import annotations

import math

from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.writers import mjcf
from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.formats.xml_file import add, document, new_element, number_text
from manitwin.geometry.rigid_body import FURNITURE_FRICTION
from manitwin.physics.mujoco.body import ROLLING_FRICTION_M, TIMESTEP_S, TORSIONAL_FRICTION_M
from manitwin.scenes.layouts.surroundings import camera_axes
from manitwin.scenes.loaded_scene import Scene
from manitwin.scenes.sapien_scene import PLAIN_COLORS

MAIN = "scene.xml"
TWINS = "twins"


def export_mjcf(scene: Scene) -> Exported:
    """Return the scene's MJCF with its twins; bodies are named ``<object>/<twin>``.

    Raises ExportError for a twin that MJCF cannot represent.
    """
    record = scene.record
    root = new_element("mujoco", model=record.scene_id)
    add(root, "option", timestep=number_text(TIMESTEP_S), integrator="implicitfast", cone="elliptic")
    asset, world = add(root, "asset"), add(root, "worldbody")
    files: dict[str, bytes] = {}
    lines: list[str] = []
    models: dict[str, str] = {}
    for placed in record.objects:
        if placed.twin_id not in models:
            content = TwinContent.of(scene.twin(placed.twin_id))
            exported = mjcf.export(content)
            folder = f"{TWINS}/{content.name}"
            files |= {f"{folder}/{name}": data for name, data in exported.files.items()}
            lines += [f"{content.name}: {line}" for line in exported.cannot_say]
            add(asset, "model", name=content.name, file=f"{folder}/{exported.main}")
            models[placed.twin_id] = content.name
    _add_surroundings(asset, world, scene)
    for placed in record.objects:
        frame = add(world, "frame", pos=number_text(*placed.position_m), quat=number_text(*placed.quaternion_wxyz))
        name = models[placed.twin_id]
        add(frame, "attach", model=name, body=name, prefix=f"{placed.name}/")
    files[MAIN] = document(
        root, [f"layout {record.scene_id}: {len(record.objects)} objects on a {record.furniture.kind}"]
    )
    return Exported(files=files, main=MAIN, cannot_say=tuple(dict.fromkeys(lines)))


def _add_surroundings(asset: etree._Element, world: etree._Element, scene: Scene) -> None:
    """Add furniture, lights and cameras."""
    record = scene.record
    for material in sorted({box.material for box in record.furniture.boxes}):
        add(asset, "material", name=material, rgba=number_text(*PLAIN_COLORS[material], 1.0))
    for number, light in enumerate(record.lights):
        add(
            world, "light", name=f"light_{number}", type="directional", pos="0 0 3", dir=number_text(*light.direction),
            diffuse=number_text(*(min(1.0, c / 2) for c in light.color)), castshadow=str(light.casts_shadow).lower(),
        )  # fmt: skip
    for camera in record.cameras:
        # MuJoCo's cameras look along -Z with +Y up
        right, up = camera_axes(camera.position_m, camera.target_m)
        add(
            world, "camera", name=camera.name, pos=number_text(*camera.position_m), xyaxes=number_text(*right, *up),
            fovy=number_text(math.degrees(camera.fov_y_rad)),
        )  # fmt: skip
    friction = number_text(FURNITURE_FRICTION, TORSIONAL_FRICTION_M, ROLLING_FRICTION_M)
    for box in record.furniture.boxes:
        add(
            world, "geom", name=box.name, type="box", pos=number_text(*box.center_m), size=number_text(*box.half_extents_m),
            material=box.material, friction=friction, condim=mjcf.CONDIM,
        )  # fmt: skip
