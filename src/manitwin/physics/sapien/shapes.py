"""Collision shapes in SAPIEN: contact properties, convex hulls that keep their vertices, and a cache of cooked hulls."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from sapien import physx

Hulls = tuple[np.ndarray, ...]
HullShapes = list[physx.PhysxCollisionShapeConvexMesh]

COOKING_SCALE = 100.0
"""Scale at which hulls are cooked before they are scaled back. PhysX drops vertices within 0.7 mm of the hull of the others
(PxCookingParams::planeTolerance, measured on prisms): a marker would roll on a coarser polygon, and a fork would be thinner.
At this scale a hull keeps all vertices beyond 7 um.
"""
KEPT_HULLS = 8192  # 72 MB at 64 vertices each: the hulls of 300 twins of 26 hulls, the mean of the 25 test objects
PATCH_RADIUS_M, MIN_PATCH_RADIUS_M = 0.01, 0.005  # of PhysX's torsional friction: that of a soft pad
# SAPIEN's four words: shapes collide if their first and second words share a bit, unless their third words share one too.
COLLIDE_WITH_ALL = (1, 1, 0, 0)
HAND_COLLISION_GROUPS = (1, 1, 2, 0)  # shapes of one hand or robot do not collide with each other
SECOND_ARM_COLLISION_GROUPS = (1, 1, 4, 0)  # a second arm collides with the first


def set_contact(
    shape: physx.PhysxCollisionShape,
    *,
    contact_offset_m: float | None = None,
    soft_pad: bool = False,
    collision_groups: Sequence[int] = COLLIDE_WITH_ALL,
) -> None:
    """Set the contact properties of a shape except its material; without ``contact_offset_m`` the shape's own value is kept.

    ``soft_pad`` gives its contacts the torsional friction of a soft fingertip.
    """
    if contact_offset_m is not None:
        shape.contact_offset = contact_offset_m
    shape.patch_radius, shape.min_patch_radius = (PATCH_RADIUS_M, MIN_PATCH_RADIUS_M) if soft_pad else (0.0, 0.0)
    shape.set_collision_groups(list(collision_groups))


def convex_shape(vertices: np.ndarray, material: physx.PhysxMaterial) -> physx.PhysxCollisionShapeConvexMesh:
    """Return the convex hull of vertices ``(V, 3)`` m as a collision shape."""
    corners = np.asarray(vertices * COOKING_SCALE, dtype=np.float32)
    return physx.PhysxCollisionShapeConvexMesh(corners, np.full(3, 1 / COOKING_SCALE, np.float32), material)


def hull_shapes(hulls: Hulls) -> HullShapes:
    """Cook hulls, each ``(V, 3)`` m, at 0.2 ms per hull; the component that takes them sets their material.

    A shape belongs to one component at a time, and is free again when that component is destroyed.
    """
    return [convex_shape(hull, physx.get_default_material()) for hull in hulls]


class HullCache:
    """Cache of cooked hulls by content, lent to one scene after another; cooking costs more than many simulation steps.

    Shapes of the least recently used bodies are dropped first, so that at most ``KEPT_HULLS`` are cached.
    """

    def __init__(self) -> None:
        self._free: OrderedDict[bytes, list[HullShapes]] = OrderedDict()
        self._count = 0

    @contextmanager
    def lent(self, bodies: Sequence[Hulls]) -> Iterator[list[HullShapes]]:
        """Lend shapes for each body's hulls, each ``(V, 3)`` m; a body that occurs twice gets two sets.

        After the block ends, the scene that used them must not be stepped any more. After an exception they are not reused.
        """
        keys = [_digest(hulls) for hulls in bodies]
        shapes = [self._take(key, hulls) for key, hulls in zip(keys, bodies, strict=True)]
        yield shapes
        for key, lent in zip(keys, shapes, strict=True):
            self._free.setdefault(key, []).append(lent)
            self._free.move_to_end(key)
            self._count += len(lent)
        while self._count > KEPT_HULLS:
            self._count -= sum(map(len, self._free.popitem(last=False)[1]))

    def _take(self, key: bytes, hulls: Hulls) -> HullShapes:
        free = self._free.get(key)
        if not free:
            return hull_shapes(hulls)
        self._count -= len(hulls)
        return free.pop()


def _digest(hulls: Hulls) -> bytes:
    digest = hashlib.blake2b(digest_size=16)
    for hull in hulls:
        digest.update(len(hull).to_bytes(4, "little"))
        digest.update(hull.tobytes())
    return digest.digest()


COOKED = HullCache()
"""The cache of this process."""
