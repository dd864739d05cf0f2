"""Cooked hulls that one scene after the other borrows: cooking 32 hulls takes as long as a tenth of a second of physics."""

from __future__ import annotations

import hashlib
from collections import OrderedDict

from sapien import physx

from manitwin.physics.kept_for_hulls import Hulls
from manitwin.physics.sapien.body import hull_shapes

Shapes = list[physx.PhysxCollisionShapeConvexMesh]
KEPT_BODIES = 256


class ShapePool:
    """Cooked hulls by their content; those of the ``KEPT_BODIES`` bodies that were asked for last are kept.

    A shape belongs to one component at a time, so what is lent is another's only after it was given back.
    """

    def __init__(self) -> None:
        self._free: OrderedDict[bytes, list[Shapes]] = OrderedDict()

    def take(self, hulls: Hulls) -> Shapes:
        """Return the shapes of hulls, each ``(V, 3)`` m: kept ones that nobody has, else fresh ones."""
        free = self._of(hulls)
        return free.pop() if free else hull_shapes(hulls)

    def give_back(self, hulls: Hulls, shapes: Shapes) -> None:
        """Lend these shapes to others again; the component that had them must be gone."""
        self._of(hulls).append(shapes)

    def _of(self, hulls: Hulls) -> list[Shapes]:
        digest = hashlib.blake2b(digest_size=16)
        for hull in hulls:
            digest.update(len(hull).to_bytes(4, "little"))
            digest.update(hull.tobytes())
        key = digest.digest()
        free = self._free.setdefault(key, [])
        self._free.move_to_end(key)
        if len(self._free) > KEPT_BODIES:
            self._free.popitem(last=False)
        return free
