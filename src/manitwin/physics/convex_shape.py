"""A convex collision shape in SAPIEN that keeps the corners it is given."""

from __future__ import annotations

import numpy as np
from sapien import physx

COOKING_SCALE = 100.0
"""PhysX drops corners within 0.7 mm of the hull of the others (PxCookingParams::planeTolerance, measured on prisms): a marker
would roll on a coarser polygon than its own, and a fork be thinner than it is. Cooked this much larger and scaled back, a
hull keeps all corners beyond 7 um."""


def convex_shape(vertices: np.ndarray, material: physx.PhysxMaterial) -> physx.PhysxCollisionShapeConvexMesh:
    """Return the convex hull of vertices ``(V, 3)`` (m) as a collision shape."""
    corners = np.asarray(vertices * COOKING_SCALE, dtype=np.float32)
    return physx.PhysxCollisionShapeConvexMesh(corners, np.full(3, 1 / COOKING_SCALE, np.float32), material)
