"""Volume integrals over a solid, discretized into cells along parallel rays."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.geometry.mass_properties import MassProperties
from manitwin.geometry.ray_caster import RayCaster

COLUMNS = 96
"""Columns along each of the shorter sides of the box; a hammer's centre of mass is exact to 1.5 mm (tested in closed form)."""
_MOST_WALLS = 40
_PAST_HIT = 1e-7  # fraction of the solid's size


def columns_of(solid: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    """Return cells that fill a watertight solid: centres ``(N, 3)`` m and volumes ``(N,)`` m3.

    Rays along the longest side of the bounding box are cut where they enter and leave the solid, and divided into cells.
    """
    low, high = (np.asarray(bound, dtype=float) for bound in solid.bounds)
    order = np.argsort(high - low)
    along, sides = int(order[2]), order[:2]
    width = (high - low)[sides] / COLUMNS
    places = [low[side] + (np.arange(COLUMNS) + 0.5) * step for side, step in zip(sides, width, strict=True)]
    origins = np.zeros((COLUMNS**2, 3))
    origins[:, sides] = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, 2)
    start = low[along] - 0.01 * float(solid.scale)
    origins[:, along] = start
    centers, volumes = [], []
    for ray, near, far in _inside(RayCaster(solid), origins, along, _PAST_HIT * float(solid.scale)):
        cells = max(1, round(COLUMNS * (far - near) / float(high[along] - low[along])))
        column = np.repeat(origins[ray][None], cells, axis=0)
        column[:, along] = start + near + (far - near) * (np.arange(cells) + 0.5) / cells
        centers.append(column)
        volumes.append(np.full(cells, (far - near) / cells * float(width.prod())))
    if not centers:
        return np.zeros((0, 3)), np.zeros(0)
    return np.concatenate(centers), np.concatenate(volumes)


def _inside(caster: RayCaster, origins: np.ndarray, along: int, past: float) -> list[tuple[int, float, float]]:
    """Return the segments inside the solid as (ray, from, to), with distances from the rays' origins."""
    direction = np.zeros(3)
    direction[along] = 1.0
    reached = np.zeros(len(origins))
    entered = np.full(len(origins), np.nan)
    open_rays = np.arange(len(origins))
    found: list[tuple[int, float, float]] = []
    for _ in range(_MOST_WALLS):
        start = origins[open_rays] + reached[open_rays, None] * direction
        distance, face = caster.first_hits(start, np.broadcast_to(direction, start.shape))
        hit = face >= 0
        open_rays, distance, face = open_rays[hit], distance[hit], face[hit]
        if not len(open_rays):
            break
        at = reached[open_rays] + distance
        leaves = caster.face_normals[face, along] > 0
        inside = np.isfinite(entered[open_rays])
        found += [
            (int(r), float(entered[r]), float(a))
            for r, a in zip(open_rays[leaves & inside], at[leaves & inside], strict=True)
        ]
        entered[open_rays[leaves]] = np.nan
        entered[open_rays[~leaves & ~inside]] = at[~leaves & ~inside]
        reached[open_rays] = at + past
    return found


def mass_properties_of(centers_m: np.ndarray, masses_kg: np.ndarray, volume_m3: float) -> MassProperties:
    """Return the mass properties of point masses ``(N,)`` kg at ``(N, 3)`` m; ``volume_m3`` is passed through."""
    center = np.average(centers_m, axis=0, weights=masses_kg)
    arms = centers_m - center
    second = np.einsum("n,ni,nj->ij", masses_kg, arms, arms)
    return MassProperties(center, np.trace(second) * np.eye(3) - second, volume_m3)
