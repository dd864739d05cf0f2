"""Variants of composites: a label on the thing, a part in the colour of the ground, and small, strongly compressed pictures."""

from __future__ import annotations

import dataclasses
from typing import Literal

import cv2
import numpy as np
from composite_things import Thing

Variant = Literal["plain", "labelled", "matched", "small", "shop", "black"]
VARIANTS: tuple[Variant, ...] = ("plain", "labelled", "matched", "small", "shop", "black")

SMALL_PX = 256
SMALL_QUALITY = 65  # JPEG quality; the colours have half the resolution (4:2:0)
LABEL_SHARE = (0.15, 0.55)  # of the thing's area
LEAST_LABEL_PX = 12
MATCHED_SHARE = (0.15, 1.0)  # of the thing's area


def labelled(rng: np.random.Generator, thing: Thing) -> Thing:
    """Return a thing with a label printed on it: a patch of another colour inside its silhouette, with bars like letters.

    The label keeps the shading of the thing: its colours are multiplied by the local brightness. A transparent thing, and one too
    thin for a label, is returned unchanged.
    """
    inside = thing.coverage > 0.99
    depth = cv2.distanceTransform(inside.astype(np.uint8), cv2.DIST_L2, 5)
    if thing.clear or depth.max() < LEAST_LABEL_PX:
        return thing
    row, column = np.unravel_index(int(depth.argmax()), depth.shape)
    area = float(rng.uniform(*LABEL_SHARE)) * inside.sum()
    ratio = float(np.exp(rng.uniform(-0.6, 0.6)))
    half = np.array([np.sqrt(area * ratio), np.sqrt(area / ratio)]) / 2
    turn = float(rng.uniform(-0.3, 0.3))
    rows, columns = np.mgrid[: depth.shape[0], : depth.shape[1]]
    along = np.cos(turn) * (columns - column) + np.sin(turn) * (rows - row)
    across = -np.sin(turn) * (columns - column) + np.cos(turn) * (rows - row)
    margin = max(2.0, 0.08 * float(depth.max()))
    patch = (abs(along) < half[0]) & (abs(across) < half[1]) & (depth > margin)
    paint = np.broadcast_to(rng.uniform(0.02, 0.9, 3), (*depth.shape, 3)).copy()
    for _ in range(int(rng.integers(2, 7))):
        middle = rng.uniform(-0.9, 0.9, 2) * half
        size = rng.uniform([0.1, 0.04], [0.6, 0.25]) * half
        paint[(abs(along - middle[0]) < size[0]) & (abs(across - middle[1]) < size[1])] = rng.uniform(0.02, 0.9, 3)
    body = thing.rgb.mean(2)
    usual = max(float(np.median(body[inside])), 1e-3)
    lit = paint * np.clip(body / usual, 0, 1.5)[..., None] * min(max(usual, 0.2), 0.8) / 0.6
    soft = cv2.GaussianBlur(patch.astype(np.float32), (0, 0), 0.7)[..., None]
    return dataclasses.replace(thing, rgb=(thing.rgb * (1 - soft) + lit * soft).astype(thing.rgb.dtype))


def matched(rng: np.random.Generator, thing: Thing, ground: np.ndarray) -> Thing:
    """Return a thing of which the part beyond a line across it has nearly the colour ``ground (3,)`` (linear light) around it.

    The part keeps its shading, like a white cap on a white table. A transparent thing is returned unchanged.
    """
    rows, columns = np.nonzero(thing.coverage > 0.5)
    if thing.clear or not len(rows):
        return thing
    turn = float(rng.uniform(-np.pi, np.pi))
    place = np.cos(turn) * columns + np.sin(turn) * rows
    line = float(np.quantile(place, 1 - rng.uniform(*MATCHED_SHARE)))
    near = ground * np.exp(rng.normal(0, 0.06, 3) + rng.normal(0, 0.12))
    grid_rows, grid_columns = np.mgrid[: thing.rgb.shape[0], : thing.rgb.shape[1]]
    beyond = np.cos(turn) * grid_columns + np.sin(turn) * grid_rows > line
    body = thing.rgb.mean(2) / np.maximum(thing.coverage, 1e-3)
    usual = max(float(np.median(body[beyond & (thing.coverage > 0.5)])), 1e-3)
    lit = near * np.clip(body / usual, 0, 2)[..., None] * thing.coverage[..., None]
    soft = cv2.GaussianBlur(beyond.astype(np.float32), (0, 0), 0.7)[..., None]
    return dataclasses.replace(thing, rgb=(thing.rgb * (1 - soft) + lit * soft).astype(thing.rgb.dtype))


def small(rgb: np.ndarray, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a picture ``(H, W, 3)`` uint8 and its true mask ``(H, W)`` at ``SMALL_PX``, compressed with ``SMALL_QUALITY``."""
    scale = SMALL_PX / max(rgb.shape[:2])
    reduced = cv2.resize(rgb, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    encoded = cv2.imencode(".jpg", reduced[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, SMALL_QUALITY])[1]
    share = cv2.resize(truth.astype(np.float32), reduced.shape[1::-1], interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(cv2.imdecode(encoded, cv2.IMREAD_COLOR)[..., ::-1]), share > 0.5
