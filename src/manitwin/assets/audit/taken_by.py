"""Collision shapes as an engine takes them out of an asset's files."""

from __future__ import annotations

from dataclasses import replace

from manitwin.assets.asset import Asset, CollisionShape

ONE_HULL = ("mujoco", "sapien", "physx")
"""Of a mesh, whatever groups it has: MuJoCo's geom mesh, SAPIEN's and Isaac's importers of URDF by default."""
A_HULL_EACH_GROUP = ("pybullet",)
"""Bullet's importer of URDF makes a compound of the groups of an OBJ file."""
TRIANGLES = ("gazebo",)
"""Gazebo's engines collide with the triangles themselves."""
OF_HULLS = ("COL003", "COL004", "COL005", "COL006", "COL007")
"""Rules of what convex hulls leave open or fill."""


def as_taken_by(asset: Asset, engine: str | None) -> Asset:
    """Return the asset with the collision shapes that an engine makes of it.

    None: as its author divided them, each group of an OBJ file a shape.
    """
    if engine in ONE_HULL or not any(shape.groups for shape in asset.collision):
        return asset
    return replace(asset, collision=tuple(each for shape in asset.collision for each in _divided(shape)))


def _divided(shape: CollisionShape) -> list[CollisionShape]:
    if not shape.groups:
        return [shape]
    return [
        CollisionShape(f"{shape.name}_{number:02d}", vertices, faces, shape.convex, shape.file)
        for number, (vertices, faces) in enumerate(shape.groups)
    ]
