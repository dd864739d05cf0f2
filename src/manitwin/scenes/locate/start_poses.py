"""Start poses: viewing directions and rolls of a twin, aligned with all observed points, or with edges that are not hidden."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.geometry.poses import rotation_between, transform
from manitwin.scenes.locate.depth_view import DepthView, known_depth
from manitwin.scenes.locate.pose_model import PoseModel

TURNS = 12
STARTS = 40
COMPARED = 120
"""Number of observed points for comparing start poses."""
_RING_PX = 4
_NOTHING_M = 1e6  # OpenCV treats an infinite border value as its own default
_NEARER_M = 0.01
_LEAST_HIDDEN, _LEAST_ONE_SIDED = 0.03, 0.3
"""Least share of the mask's border that is hidden by something nearer, and its least one-sidedness (1: one direction)."""
_EDGE = 0.03


def hidden_direction(view: DepthView, mask: np.ndarray) -> np.ndarray | None:
    """Return the picture direction ``(2,)`` (right, down) in which something nearer, or the frame, cuts the object off.

    None if nothing does, or if it is cut off on all sides.
    """
    inner = np.pad(np.where(mask & known_depth(view), view.depth_m, _NOTHING_M), _RING_PX, constant_values=_NOTHING_M)
    kernel = np.ones((2 * _RING_PX + 1,) * 2, np.uint8)
    beside = np.asarray(cv2.erode(inner, kernel, borderType=cv2.BORDER_CONSTANT, borderValue=(_NOTHING_M,)))
    shown = np.pad(mask, _RING_PX)
    depth = np.pad(view.depth_m, _RING_PX, constant_values=-1.0)
    ring = (beside < _NOTHING_M) & ~shown & (depth != 0)
    hides = ring & (depth < beside - _NEARER_M)  # outside the frame it is -1, nearer than anything
    if not ring.any() or hides.sum() < _LEAST_HIDDEN * ring.sum():
        return None
    rows, columns = np.nonzero(shown)
    middle = np.array([columns.mean(), rows.mean()])
    rows, columns = np.nonzero(hides)
    away = np.stack([columns, rows], 1) - middle
    mean = (away / np.linalg.norm(away, axis=1, keepdims=True)).mean(0)
    length = float(np.linalg.norm(mean))
    return None if length < _LEAST_ONE_SIDED else mean / length


def find_start_poses(observed: np.ndarray, model: PoseModel, hidden: np.ndarray | None) -> np.ndarray:
    """Return the poses ``object_to_camera (STARTS, 4, 4)`` whose visible points are closest to the observed ones ``(N, 3)``.

    If there is a ``hidden (2,)`` direction, half of them are aligned with the edges opposite to it, because the mean of the
    visible points of a partly hidden object is not that of the object.
    """
    sets = [_ranked(observed, model, None)]
    if hidden is not None:
        sets.append(_ranked(observed, model, hidden))
    each = STARTS // len(sets)
    return np.concatenate([poses[:each] for poses in sets])


def _ranked(observed: np.ndarray, model: PoseModel, hidden: np.ndarray | None) -> np.ndarray:
    mean = observed.mean(0)
    toward = -mean / np.linalg.norm(mean)
    angles = np.arange(TURNS) * (2 * np.pi / TURNS)
    rolls = Rotation.from_rotvec(angles[:, None] * toward).as_matrix()
    few = observed[:COMPARED]
    found, costs = [], []
    for side, shown, tree in zip(model.sides, model.shown, model.shown_trees, strict=True):
        turned = rolls @ rotation_between(side, toward)
        drawn = np.einsum("kij,sj->ksi", turned, shown)
        shift = mean - drawn.mean(1) if hidden is None else _at_edges(observed, drawn, hidden)
        at = np.einsum("kji,knj->kni", turned, few - shift[:, None])
        distance, _ = tree.query(at.reshape(-1, 3))
        costs.append(np.minimum(distance.reshape(TURNS, -1), 0.1 * model.diameter_m).mean(1))
        found.append([transform(r, t) for r, t in zip(turned, shift, strict=True)])
    order = np.argsort(np.concatenate(costs), kind="stable")[:STARTS]
    return np.concatenate(found)[order]


def _at_edges(observed: np.ndarray, drawn: np.ndarray, hidden: np.ndarray) -> np.ndarray:
    """Return the shifts ``(K, 3)`` that align rendered points ``(K, S, 3)`` with the observed edge opposite to ``hidden``.

    Perpendicular to that direction, the middles of the points within the observed range are aligned, and in depth the means.
    """
    across = np.array([-hidden[1], hidden[0]])
    seen_along, seen_across = observed[:, :2] @ hidden, observed[:, :2] @ across
    along, beside = drawn[..., :2] @ hidden, drawn[..., :2] @ across
    shift_along = np.quantile(seen_along, _EDGE) - np.quantile(along, _EDGE, axis=1)
    within = along + shift_along[:, None] <= np.quantile(seen_along, 1 - _EDGE)
    low = np.where(within, beside, np.inf).min(1)
    high = np.where(within, beside, -np.inf).max(1)
    seen_middle = (np.quantile(seen_across, _EDGE) + np.quantile(seen_across, 1 - _EDGE)) / 2
    shift_across = seen_middle - (low + high) / 2
    depth = (drawn[..., 2] * within).sum(1) / within.sum(1)
    lateral = shift_along[:, None] * hidden + shift_across[:, None] * across
    return np.column_stack([lateral, observed[:, 2].mean() - depth])
