"""Visuals of SAPIEN scenes: a twin's GLB file, plain boxes, and the visual shapes of a robot's URDF.

SAPIEN reads the files itself here. The rendered pictures of this package upload prepared arrays instead
(``manitwin.render.surfaces``).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import sapien
from lxml import etree  # type: ignore[import-untyped]
from sapien import physx

from manitwin.geometry.poses import GLTF_TO_OBJECT
from manitwin.robots.urdf import UrdfTree, geometry_of, origin_of, values_of

_GREY = (0.7, 0.7, 0.7, 1.0)
_X_TO_Z = np.array([[0.0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]])


def glb_visual(path: Path) -> Any:
    """Return a Y-up glTF file as a render component in the object frame (+Z up)."""
    from sapien import render

    shape = render.RenderShapeTriangleMesh(str(path))
    shape.local_pose = sapien.Pose(GLTF_TO_OBJECT)
    return _component([shape])


def box_visual(half_extents_m: np.ndarray, rgb: tuple[float, float, float]) -> Any:
    """Return a box of one colour (linear RGB) as a render component."""
    from sapien import render

    return _component([render.RenderShapeBox(half_extents_m, _plain_material((*rgb, 1.0), roughness=0.7))])


def add_robot_visuals(
    urdf: str,
    bodies: dict[str, physx.PhysxArticulationLinkComponent],
    part_of: dict[str, tuple[str, np.ndarray]],
) -> None:
    """Attach the visuals of a robot's links to its bodies; ``part_of`` maps each link to its body and its pose there."""
    shapes: dict[str, list[Any]] = {}
    for link, shape_to_link, geometry, rgba in _visuals(urdf):
        body, link_to_body = part_of[link]
        shape = _shape(geometry, rgba)
        shape.local_pose = sapien.Pose(link_to_body @ shape_to_link)
        shapes.setdefault(body, []).append(shape)
    for name, of_body in shapes.items():
        bodies[name].entity.add_component(_component(of_body))


def _component(shapes: Sequence[Any]) -> Any:
    from sapien import render

    component = render.RenderBodyComponent()
    for shape in shapes:
        component.attach(shape)
    return component


def _plain_material(rgba: tuple[float, ...], *, roughness: float) -> Any:
    from sapien import render

    return render.RenderMaterial(base_color=list(rgba), roughness=roughness, metallic=0.0)


def _shape(geometry: etree._Element, rgba: tuple[float, ...] | None) -> Any:
    from sapien import render

    material = _plain_material(rgba or _GREY, roughness=0.6)
    if geometry.tag == "mesh":
        path, scale = geometry.get("filename"), values_of(geometry, "scale", "1 1 1").astype(np.float32)
        if rgba is None and not path.lower().endswith(".stl"):  # STL files have no colours
            return render.RenderShapeTriangleMesh(path, scale)
        return render.RenderShapeTriangleMesh(path, scale, material)
    if geometry.tag == "box":
        return render.RenderShapeBox(values_of(geometry, "size").astype(np.float32) / 2, material)
    radius_m = float(geometry.get("radius"))
    if geometry.tag == "sphere":
        return render.RenderShapeSphere(radius_m, material)
    return render.RenderShapeCylinder(radius_m, float(geometry.get("length")) / 2, material)


@lru_cache(maxsize=16)
def _visuals(urdf: str) -> tuple[tuple[str, np.ndarray, etree._Element, tuple[float, ...] | None], ...]:
    """Return link, pose in the link, geometry and colour of each visual, in SAPIEN's axes."""
    tree = UrdfTree.of_text(urdf)
    named = {one.get("name"): _color(one) for one in tree.element.findall("material")}
    found = []
    for name, link in tree.links.items():
        for visual in link.findall("visual"):
            material, geometry = visual.find("material"), geometry_of(visual)
            rgba = None if material is None else (_color(material) or named.get(material.get("name")))
            # URDF's cylinder is along Z, SAPIEN's along X
            pose = origin_of(visual) @ (_X_TO_Z if geometry.tag == "cylinder" else np.eye(4))
            found.append((name, pose, geometry, rgba))
    return tuple(found)


def _color(material: etree._Element) -> tuple[float, ...] | None:
    color = material.find("color")
    return None if color is None else tuple(values_of(color, "rgba").tolist())
