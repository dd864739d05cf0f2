"""Batches of point clouds with grasps for training."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from typing import Any, Literal

import numpy as np
import pyarrow as pa

from manitwin.dataset.index.conditions import sql_texts
from manitwin.dataset.index.query import Index, grasps_of
from manitwin.dataset.index.rows import VISUAL
from manitwin.dataset.index.twins import local_files
from manitwin.errors import UsageError, unknown_name_message
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.geometry.sampling import sample_surface
from manitwin.twin.shape_file import surface

_COLUMNS = ("twin_id", "gripper", "position_m", "quaternion_wxyz", "verified")
_USUAL = "NOT retired AND NOT suffix(proposer, ':unfiltered') AND NOT suffix(proposer, ':jittered')"


def batches(
    index: Index,
    twins: pa.Table,
    size: int,
    *,
    points: int,
    grasps: int,
    verified_only: bool,
    framework: Literal["numpy", "torch"],
    seed: int,
) -> Iterator[dict[str, Any]]:
    """Yield every twin (columns ``twin_id, category, gripper``) once, in an order given by the seed, as batches of arrays.

    A batch has ``points (N, P, 3) float32`` in metres, sampled uniformly by area on the visual mesh, in the object frame;
    ``grasps (N, G, 4, 4) float32``, transforms ``gripper_to_object``; ``mask (N, G) bool``, true for rows that are grasps (the
    other rows are the identity); ``verified (N, G) bool``; and ``twin_ids``, a list of N ids. Arrays are torch tensors if the
    framework is torch.

    Only grasps of the twin's own gripper are used, without retired grasps, the unfiltered sample and the jittered controls. If
    there are more than G, G are drawn at random. ``verified_only`` keeps only grasps that held in simulation. The draws for a
    twin depend on the seed and its id alone, not on the batch. Raises UsageError for sizes below 1, an unknown framework or one
    that is not installed, and TwinError for a mesh that cannot be read.
    """
    for name, value in (("size", size), ("points", points), ("grasps", grasps)):
        if value < 1:
            raise UsageError(f"{name} is {value}; give 1 or more")
    convert = _converter(framework)
    order = np.random.default_rng(seed).permutation(len(twins))

    def batch(chunk: np.ndarray) -> dict[str, Any]:
        some = twins.take(pa.array(chunk))
        ids = some["twin_id"].to_pylist()
        found = _grasps(index, some, verified_only)
        rngs = [_rng(seed, twin_id) for twin_id in ids]
        clouds = [_cloud(index, twin_id, points, rng) for twin_id, rng in zip(ids, rngs, strict=True)]
        drawn = [_draw_grasps(*found[twin_id], grasps, rng) for twin_id, rng in zip(ids, rngs, strict=True)]
        poses, mask, verified = (np.stack(each) for each in zip(*drawn, strict=True))
        arrays = {"points": np.stack(clouds), "grasps": poses, "mask": mask, "verified": verified}
        return {**{name: convert(array) for name, array in arrays.items()}, "twin_ids": ids}

    return (batch(order[i : i + size]) for i in range(0, len(order), size))


def _converter(framework: str) -> Callable[[np.ndarray], Any]:
    if framework == "numpy":
        return lambda array: array
    if framework != "torch":
        raise UsageError(unknown_name_message("framework", framework, ("numpy", "torch")))
    try:
        from torch import from_numpy
    except ImportError as error:
        raise UsageError(
            "framework torch: PyTorch is not installed; run pip install torch, or use framework numpy"
        ) from error
    convert: Callable[[np.ndarray], Any] = from_numpy
    return convert


def _rng(seed: int, twin_id: str) -> np.random.Generator:
    return np.random.default_rng(list(hashlib.sha256(f"{seed}:{twin_id}".encode()).digest()))


def _cloud(index: Index, twin_id: str, count: int, rng: np.random.Generator) -> np.ndarray:
    with local_files(index.root, twin_id, (VISUAL,)) as folder:
        return sample_surface(surface(folder / VISUAL), count, rng)[0].astype(np.float32)


def _grasps(index: Index, twins: pa.Table, verified_only: bool) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return the poses ``(n, 4, 4)`` and verdicts ``(n,)`` of each twin's grasps, keyed by twin id."""
    gripper_of = dict(zip(twins["twin_id"].to_pylist(), twins["gripper"].to_pylist(), strict=True))
    where = [
        *grasps_of(twins),
        f"gripper IN ({sql_texts(sorted(set(gripper_of.values())))})",
        _USUAL,
        *(["verified"] if verified_only else []),
    ]
    rows = index.select("grasps", where, columns=_COLUMNS)
    # Copy: arrays over Arrow memory are read-only, and scipy refuses those.
    positions = np.array(rows["position_m"].combine_chunks().flatten()).reshape(-1, 3)
    quaternions = np.array(rows["quaternion_wxyz"].combine_chunks().flatten()).reshape(-1, 4)
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotation_from_quaternion_wxyz(quaternions), positions
    verified = rows["verified"].to_numpy(zero_copy_only=False).astype(bool)
    ids, grippers = (rows[name].to_numpy(zero_copy_only=False).astype(str) for name in ("twin_id", "gripper"))
    own = {twin_id: (ids == twin_id) & (grippers == gripper) for twin_id, gripper in gripper_of.items()}
    return {twin_id: (poses[which], verified[which]) for twin_id, which in own.items()}


def _draw_grasps(
    poses: np.ndarray, verified: np.ndarray, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return up to ``count`` grasps padded with the identity to ``(count, 4, 4)``, the mask of real grasps, and the verdicts."""
    chosen = np.sort(rng.choice(len(poses), count, replace=False)) if len(poses) > count else np.arange(len(poses))
    filled = np.tile(np.eye(4, dtype=np.float32), (count, 1, 1))
    mask, held = np.zeros(count, bool), np.zeros(count, bool)
    filled[: len(chosen)], mask[: len(chosen)], held[: len(chosen)] = poses[chosen], True, verified[chosen]
    return filled, mask, held
