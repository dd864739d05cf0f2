"""The look of an asset that has none: simulators show what collides of a body without a visual shape."""

from __future__ import annotations

from dataclasses import replace

from manitwin.assets.asset import Asset
from manitwin.formats.meshes.textures import DEFAULT_COLOR, make_part, pbr_material

SAID = "nothing of it is seen: its collision shapes were taken for what it looks like, grey"


def shown_by_what_collides(asset: Asset) -> Asset:
    """Return an asset of which nothing is seen with its collision shapes as its look, and a remark; any other as it is.

    PyBullet and MuJoCo draw such bodies so. An asset whose meshes are missing, or in which something moves, stays as it is: which
    link a shape is of is not known.
    """
    seen = any(len(part.faces) for part in asset.visual)
    shapes = [shape for shape in asset.collision if len(shape.faces)]
    if seen or not shapes or asset.missing_files or asset.articulation is not None:
        return asset
    grey = pbr_material(base_color=DEFAULT_COLOR)
    parts = tuple(make_part(shape.vertices, shape.faces, material=grey, name=shape.name) for shape in shapes)
    return replace(asset, visual=parts, remarks=(*asset.remarks, SAID))
