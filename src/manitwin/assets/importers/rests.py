"""Resting poses of imported assets, put onto the plane that they are to rest on."""

from __future__ import annotations

import numpy as np

from manitwin.assets.asset import Asset
from manitwin.geometry.poses import inverse, transform_points

_OFF_M = 1e-3  # a millimetre above the table an object falls, below it a simulator throws it out


def settled_rests(asset: Asset, asset_to_object: np.ndarray) -> tuple[list[np.ndarray], list[str]]:
    """Return the resting poses, object frame to plane ``(4, 4)``, each with the lowest point on z = 0; and remarks.

    Published annotations are off the true lowest point, so that their users lift objects by hand; the turn is kept, the
    height is that of the mesh.
    """
    points = [part.vertices[np.unique(part.faces)] for part in asset.visual if len(part.faces)]
    if not points or not asset.rests:
        return [], []
    vertices = np.concatenate(points)
    rests, remarks = [], []
    for number, declared in enumerate(asset.rests):
        lowest_m = float(transform_points(declared, vertices)[:, 2].min())
        rest = declared.copy()
        rest[2, 3] -= lowest_m
        rests.append(rest @ inverse(asset_to_object))
        if abs(lowest_m) > _OFF_M:
            where = "above" if lowest_m > 0 else "below"
            remarks.append(
                f"place {number} puts the lowest point {abs(lowest_m) * 1000:.1f} mm {where} the plane; it was set down on it"
            )
    return rests, remarks
