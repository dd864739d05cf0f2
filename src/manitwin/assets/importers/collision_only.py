"""Visual geometry for assets without any: simulators draw the collision shapes of such bodies."""

from __future__ import annotations

from dataclasses import replace

from manitwin.assets.asset import Asset
from manitwin.formats.meshes.textures import DEFAULT_COLOR, make_part, pbr_material

SAID = "nothing of it is seen: its collision shapes were taken for what it looks like, grey"


def with_collision_as_visual(asset: Asset) -> Asset:
    """Return an asset without visual geometry with grey copies of its collision shapes, and a remark; others unchanged.

    PyBullet and MuJoCo draw such bodies this way. Assets with missing meshes or with an articulation also stay unchanged: the
    link of each collision shape is unknown.
    """
    seen = any(len(part.faces) for part in asset.visual)
    shapes = [shape for shape in asset.collision if len(shape.faces)]
    if seen or not shapes or asset.missing_files or asset.articulation is not None:
        return asset
    grey = pbr_material(base_color=DEFAULT_COLOR)
    parts = tuple(make_part(shape.vertices, shape.faces, material=grey, name=shape.name) for shape in shapes)
    return replace(asset, visual=parts, remarks=(*asset.remarks, SAID))
