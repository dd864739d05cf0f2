"""Visuals of SAPIEN scenes: a twin's GLB file, plain boxes, and the visual shapes of a robot's URDF.

SAPIEN reads the files itself here. The pictures of this package upload prepared arrays instead: ``manitwin.render.surfaces``.
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
from manitwin.robots.urdf import UrdfTree, geometry_of, origin_of

_GREY = (0.7, 0.7, 0.7, 1.0)
Visual = tuple[str, np.ndarray, str, tuple[Any, ...], tuple[float, ...] | None]


def glb_visual(path: Path) -> Any:
    """Return a Y-up glTF file as a component in the object frame (+Z up)."""
    from sapien import render

    shape = render.RenderShapeTriangleMesh(str(path))
    shape.local_pose = sapien.Pose(GLTF_TO_OBJECT)
    return _component([shape])


def box_visual(half_extents_m: np.ndarray, rgb: tuple[float, float, float]) -> Any:
    """Return a box of one colour (linear RGB) as a component."""
    from sapien import render

    return _component([render.RenderShapeBox(half_extents_m, _plain_material((*rgb, 1.0), roughness=0.7))])


def add_robot_visuals(
    urdf: str,
    bodies: dict[str, physx.PhysxArticulationLinkComponent],
    part_of: dict[str, tuple[str, np.ndarray]],
) -> None:
    """Give the bodies in a scene the visuals of their links; ``part_of`` has each link's body and pose in it."""
    shapes: dict[str, list[Any]] = {}
    for link, shape_to_link, kind, numbers, rgba in _visuals(urdf):
        body, link_to_body = part_of[link]
        shape = _shape(kind, numbers, rgba)
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


def _shape(kind: str, numbers: tuple[Any, ...], rgba: tuple[float, ...] | None) -> Any:
    from sapien import render

    material = _plain_material(rgba or _GREY, roughness=0.6)
    if kind == "mesh":
        path, scale = numbers
        own = rgba is None and not path.lower().endswith(".stl")  # an STL has no colours of its own
        scale_xyz = np.array(scale, np.float32)
        return (
            render.RenderShapeTriangleMesh(path, scale_xyz)
            if own
            else render.RenderShapeTriangleMesh(path, scale_xyz, material)
        )
    if kind == "box":
        return render.RenderShapeBox(np.array(numbers, np.float32) / 2, material)
    if kind == "sphere":
        return render.RenderShapeSphere(numbers[0], material)
    return render.RenderShapeCylinder(numbers[0], numbers[1] / 2, material)


@lru_cache(maxsize=16)
def _visuals(urdf: str) -> tuple[Visual, ...]:
    tree = UrdfTree.of_text(urdf)
    named = {one.get("name"): _color(one) for one in tree.element.findall("material")}
    found = []
    for name, link in tree.links.items():
        for visual in link.findall("visual"):
            material, geometry = visual.find("material"), geometry_of(visual)
            rgba = None if material is None else (_color(material) or named.get(material.get("name")))
            pose, numbers = origin_of(visual), _numbers(geometry)
            if geometry.tag == "cylinder":  # URDF's lies along Z, SAPIEN's along X
                pose = pose @ _X_TO_Z
            found.append((name, pose, geometry.tag, numbers, rgba))
    return tuple(found)


_X_TO_Z = np.array([[0.0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]])


def _color(material: etree._Element) -> tuple[float, ...] | None:
    color = material.find("color")
    return None if color is None else tuple(float(word) for word in color.get("rgba").split())


def _numbers(geometry: etree._Element) -> tuple[Any, ...]:
    if geometry.tag == "mesh":
        return geometry.get("filename"), tuple(float(word) for word in geometry.get("scale", "1 1 1").split())
    if geometry.tag == "box":
        return tuple(float(word) for word in geometry.get("size").split())
    if geometry.tag == "sphere":
        return (float(geometry.get("radius")),)
    return float(geometry.get("radius")), float(geometry.get("length"))
