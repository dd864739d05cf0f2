"""Collision shapes in SAPIEN: how they touch, convex hulls that keep their corners, and the one cache of cooked hulls."""

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
"""PhysX drops corners within 0.7 mm of the hull of the others (PxCookingParams::planeTolerance, measured on prisms): a marker
would roll on a coarser polygon than its own, and a fork be thinner than it is. Cooked this much larger and scaled back, a
hull keeps all corners beyond 7 um."""
KEPT_HULLS = 8192  # 72 MB at 64 corners each: those of 300 twins of 26 hulls, as the 25 test objects have in the mean
PATCH_RADIUS_M, MIN_PATCH_RADIUS_M = 0.01, 0.005  # of PhysX's torsional friction: that of a soft pad
# Of SAPIEN's four words: shapes whose first and second words have common bits collide, unless their third words have one too.
COLLIDE_WITH_ALL = (1, 1, 0, 0)
HAND_COLLISION_GROUPS = (1, 1, 2, 0)  # those of one hand or robot do not collide with one another
SECOND_ARM_COLLISION_GROUPS = (1, 1, 4, 0)  # of a second arm, which collides with the first


def set_contact(
    shape: physx.PhysxCollisionShape,
    *,
    contact_offset_m: float | None = None,
    soft_pad: bool = False,
    collision_groups: Sequence[int] = COLLIDE_WITH_ALL,
) -> None:
    """Set all that decides how a shape touches but its material; without ``contact_offset_m`` its own applies.

    ``soft_pad`` gives its contacts the torsional friction of a soft fingertip.
    """
    if contact_offset_m is not None:
        shape.contact_offset = contact_offset_m
    shape.patch_radius, shape.min_patch_radius = (PATCH_RADIUS_M, MIN_PATCH_RADIUS_M) if soft_pad else (0.0, 0.0)
    shape.set_collision_groups(list(collision_groups))


def convex_shape(vertices: np.ndarray, material: physx.PhysxMaterial) -> physx.PhysxCollisionShapeConvexMesh:
    """Return the convex hull of vertices ``(V, 3)`` (m) as a collision shape."""
    corners = np.asarray(vertices * COOKING_SCALE, dtype=np.float32)
    return physx.PhysxCollisionShapeConvexMesh(corners, np.full(3, 1 / COOKING_SCALE, np.float32), material)


def hull_shapes(hulls: Hulls) -> HullShapes:
    """Cook hulls, each ``(V, 3)`` m, at 0.2 ms a hull; the component that takes them gives them its material.

    A shape belongs to one component at a time, and is free again when that is gone.
    """
    return [convex_shape(hull, physx.get_default_material()) for hull in hulls]


class HullCache:
    """Cooked hulls by their content, lent to one scene after the other: cooking costs more than many a step.

    Of the bodies that were not asked for lately the shapes go first, so that no more than ``KEPT_HULLS`` lie here.
    """

    def __init__(self) -> None:
        self._free: OrderedDict[bytes, list[HullShapes]] = OrderedDict()
        self._count = 0

    @contextmanager
    def lent(self, bodies: Sequence[Hulls]) -> Iterator[list[HullShapes]]:
        """Lend shapes for each body's hulls, each ``(V, 3)`` m; a body that comes twice gets two sets.

        When the block ends, nothing may step the scene that had them any more. After an exception they are not lent again.
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
