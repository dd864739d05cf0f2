"""The collision shapes that an engine makes of an asset's meshes: one hull, a hull for each group, or the triangles."""

from __future__ import annotations

from dataclasses import replace

from manitwin.assets.asset import Asset, CollisionShape
from manitwin.assets.audit.convex_shapes import ConvexShapes

ONE_HULL = ("mujoco", "sapien", "physx")
"""Engines that make one hull of a mesh, whatever groups it has: MuJoCo, and SAPIEN's and Isaac's importers of URDF by default."""
A_HULL_EACH_GROUP = ("pybullet",)
"""Engines that make a hull of each group of an OBJ file: Bullet's importer of URDF makes a compound of them."""
TRIANGLES = ("gazebo",)
"""Engines that collide with the triangles of a mesh themselves."""
DRAWN_FORMATS = ("sdf",)
"""Formats of these engines: where no engine is named, their concave meshes count as their triangles."""
OF_HULLS = ("COL003", "COL004", "COL005", "COL006", "COL007")
"""The rules about what convex hulls fill or leave open, which do not apply to triangles."""


def as_taken_by(asset: Asset, engine: str | None) -> Asset:
    """Return the asset with the collision shapes that an ``engine`` makes of it.

    Without an engine they are what the author meant: each group of an OBJ file is a shape, unless some group has no volume, as
    where groups are the faces of one solid.
    """
    if engine in ONE_HULL or not any(shape.groups for shape in asset.collision):
        return asset
    meant = engine is None
    return replace(asset, collision=tuple(each for shape in asset.collision for each in divided(shape, meant)))


def divided(shape: CollisionShape, meant: bool) -> list[CollisionShape]:
    """Return a shape for each of its groups that has a volume.

    ``meant``: as its author meant it, so that it stays whole where some group has none.
    """
    flat = set(ConvexShapes.of([vertices for vertices, _ in shape.groups]).flat)
    if not shape.groups or (meant and flat):
        return [shape]
    return [
        CollisionShape(f"{shape.name}_{number:02d}", vertices, faces, shape.convex, shape.file)
        for number, (vertices, faces) in enumerate(shape.groups)
        if number not in flat
    ]
