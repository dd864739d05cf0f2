"""Agreement of a mesh with the true one, independent of position, rotation and scale.

Both meshes lie in object frames (Z up). One photo determines the shape up to a rotation about the vertical and a scale, so the
built mesh is first aligned by rotation, translation and scale. The start orientations are 36 rotations about the vertical
(``upright``) or 24 right-angled rotations times 6 about the vertical (``free``), at equal volume. The best five by overlap are
refined by iterative closest points with scale (Besl and McKay 1992; Umeyama 1991), and the best of these by Nelder-Mead on the
overlap itself. The overlap is counted over random interior points, in voxels of 1/88 of the longest side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from scipy import ndimage
from scipy.optimize import minimize
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

VOXELS = 88  # along the longest side
POINTS = 4000
REFINED = 5
ROUNDS = 15
SURFACE_POINTS = 3000
BARRIER_POINTS = 200_000
GOOD = 0.93  # upright agreement above which other orientations are not tried


@dataclass(frozen=True)
class Agreement:
    """IoU of the solids, IoU with hollows filled to the brim, and chamfer distance over the longest side."""

    iou: float
    filled_iou: float
    upright_filled_iou: float
    chamfer_share: float


@dataclass(frozen=True)
class Voxels:
    """A solid as a grid ``(X, Y, Z)`` bool of cells of ``cell_m``, with its first corner at ``origin_m``."""

    grid: np.ndarray
    origin_m: np.ndarray
    cell_m: float

    @property
    def volume_m3(self) -> float:
        """Volume of the filled cells."""
        return float(self.grid.sum()) * self.cell_m**3

    def holds(self, points_m: np.ndarray) -> np.ndarray:
        """Return which of the points ``(N, 3)`` lie inside."""
        index = np.floor((points_m - self.origin_m) / self.cell_m).astype(int)
        valid = ((index >= 0) & (index < self.grid.shape)).all(axis=1)
        inside = np.zeros(len(points_m), bool)
        inside[valid] = self.grid[tuple(index[valid].T)]
        return inside

    def drawn(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return random points ``(count, 3)`` inside."""
        cells = np.argwhere(self.grid)
        chosen = cells[rng.integers(len(cells), size=count)]
        return self.origin_m + (chosen + rng.random((count, 3))) * self.cell_m


def voxelised(mesh: trimesh.Trimesh) -> Voxels:
    """Return a closed mesh as voxels, by the intersections of lines along x with its surface."""
    low, high = mesh.bounds
    cell = float((high - low).max()) / VOXELS
    shape = np.maximum(np.ceil((high - low) / cell).astype(int), 1) + 2
    origin = (low + high) / 2 - shape * cell / 2
    y, z = np.meshgrid(np.arange(shape[1]), np.arange(shape[2]), indexing="ij")
    # An irregular offset from the centre, because a line through an edge of the mesh would count twice.
    starts = np.column_stack([np.full(y.size, -1.0), y.ravel() + 0.5013, z.ravel() + 0.4987]) * cell + origin
    where, ray, _ = mesh.ray.intersects_location(starts, np.tile([1.0, 0, 0], (len(starts), 1)), multiple_hits=True)
    at = (where[:, 0] - origin[0]) / cell
    first = np.clip(np.ceil(at - 0.5).astype(int), 0, shape[0])
    flips = np.zeros((shape[0] + 1, len(starts)), int)
    np.add.at(flips, (first, ray), 1)
    grid = (np.cumsum(flips, axis=0)[:-1] % 2 == 1).reshape(shape[0], shape[1], shape[2])
    return Voxels(grid, origin, cell)


def filled_to_the_brim(voxels: Voxels, mesh: trimesh.Trimesh) -> Voxels:
    """Return the solid with the volume that poured liquid would fill; walls thinner than a voxel hold too."""
    surface = trimesh.sample.sample_surface(mesh, BARRIER_POINTS, seed=0)[0]
    barrier = voxels.grid.copy()
    barrier[tuple(np.floor((surface - voxels.origin_m) / voxels.cell_m).astype(int).T)] = True
    grid = voxels.grid.copy()
    for level in range(grid.shape[2]):
        labels, count = ndimage.label(~barrier[:, :, : level + 1])
        rim = np.zeros(count + 1, bool)
        for side in (labels[0], labels[-1], labels[:, 0], labels[:, -1], labels[:, :, 0]):
            rim[np.unique(side)] = True
        rim[0] = True
        grid[:, :, level] |= ~rim[labels[:, :, level]]
    if grid.sum() > voxels.grid.sum():
        grid = ndimage.binary_closing(grid) | grid  # cells cut by a wall, between it and the liquid
    return Voxels(grid, voxels.origin_m, voxels.cell_m)


def agreement(built: trimesh.Trimesh, truth: trimesh.Trimesh, seed: int = 0) -> Agreement:
    """Align ``built`` with ``truth`` and compare them; both closed, in object frames."""
    rng = np.random.default_rng(seed)
    solids = voxelised(built), voxelised(truth)
    filled = filled_to_the_brim(solids[0], built), filled_to_the_brim(solids[1], truth)
    a = trimesh.sample.sample_surface(built, SURFACE_POINTS, seed=seed)[0]
    b = trimesh.sample.sample_surface(truth, SURFACE_POINTS, seed=seed)[0]
    upright, moved = free, _ = _aligned(*filled, a, b, rng, _turns_about_z(36))
    if upright < GOOD:
        turned, other = _aligned(*filled, a, b, rng, _all_turns())
        if turned > free:
            free, moved = turned, other
    inside = solids[1].holds(moved.apply(solids[0].drawn(4 * POINTS, rng))).mean()
    iou = _iou(float(inside), moved.scale**3 * solids[0].volume_m3, solids[1].volume_m3)
    a = moved.apply(a)
    chamfer = (cKDTree(a).query(b)[0].mean() + cKDTree(b).query(a)[0].mean()) / 2
    return Agreement(iou, free, upright, float(chamfer / np.ptp(truth.vertices, axis=0).max()))


@dataclass(frozen=True)
class Similarity:
    """The map ``scale * rotation @ x + offset_m``."""

    scale: float
    rotation: np.ndarray
    offset_m: np.ndarray

    def apply(self, points: np.ndarray) -> np.ndarray:
        """Return the transformed points ``(N, 3)``."""
        return np.asarray(self.scale * points @ self.rotation.T + self.offset_m)


def _aligned(
    built: Voxels, truth: Voxels, a: np.ndarray, b: np.ndarray, rng: np.random.Generator, turns: np.ndarray
) -> tuple[float, Similarity]:
    points, target = built.drawn(POINTS, rng), truth.drawn(POINTS, rng)
    center, aim = points.mean(axis=0), target.mean(axis=0)
    start = float(np.cbrt(truth.volume_m3 / built.volume_m3))

    def iou(moved: Similarity) -> float:
        share = float(truth.holds(moved.apply(points)).mean())
        return _iou(share, moved.scale**3 * built.volume_m3, truth.volume_m3)

    starts = [Similarity(start, turn, aim - start * turn @ center) for turn in turns]
    scores = np.array([iou(each) for each in starts])
    tried = [starts[k] for k in np.argsort(scores)[::-1][:REFINED]]
    tree = cKDTree(b)
    tried += [_closest_points(each, a, b, tree) for each in tried]
    best = max(tried, key=iou)
    unit = best.scale * float(np.cbrt(built.volume_m3))
    pivot = best.apply(center[None])[0]

    def shifted(x: np.ndarray) -> Similarity:
        scale = best.scale * float(np.exp(x[6]))
        rotation = Rotation.from_rotvec(x[:3]).as_matrix() @ best.rotation
        return Similarity(scale, rotation, pivot + unit * x[3:6] - scale * rotation @ center)

    simplex = np.vstack([np.zeros(7), 0.04 * np.eye(7)])
    found = minimize(
        lambda x: -iou(shifted(x)),
        np.zeros(7),
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": 250},
    )
    return -float(found.fun), shifted(found.x)


def _closest_points(moved: Similarity, a: np.ndarray, b: np.ndarray, tree: cKDTree) -> Similarity:
    for _ in range(ROUNDS):
        at = moved.apply(a)
        forth = tree.query(at)[1]
        back = cKDTree(at).query(b)[1]
        source, target = np.concatenate([a, a[back]]), np.concatenate([b[forth], b])
        mean, aim = source.mean(axis=0), target.mean(axis=0)
        u, values, v = np.linalg.svd((target - aim).T @ (source - mean))
        sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ v))])
        rotation = (u * sign) @ v
        scale = float((values * sign).sum() / ((source - mean) ** 2).sum())
        moved = Similarity(scale, rotation, aim - scale * rotation @ mean)
    return moved


def _iou(share_inside: float, built_m3: float, truth_m3: float) -> float:
    both = share_inside * built_m3
    return both / (built_m3 + truth_m3 - both)


def _turns_about_z(count: int) -> np.ndarray:
    return np.asarray(Rotation.from_rotvec(np.outer(np.arange(count) * 2 * np.pi / count, [0, 0, 1])).as_matrix())


def _all_turns() -> np.ndarray:
    right_angled = Rotation.create_group("O").as_matrix()
    about = Rotation.from_rotvec(np.outer(np.arange(6) * np.pi / 12, [0, 0, 1])).as_matrix()
    return np.einsum("aij,bjk->abik", about, right_angled).reshape(-1, 3, 3)
