"""Hard cast shadows: strips beside an object that the soft flood stops at, told from grey parts by how they are bounded."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

from manitwin.models.matting.background import MAX_SHADE, Background, length
from manitwin.models.matting.outline import dilated, disk, eroded, opened
from manitwin.models.matting.shadow import falls_inward

MIN_LIGHT = 0.10  # of the background's light: deeper than that nothing is left to tell colours by
TINT, CERTAIN_TINT = 0.10, 0.20  # spread of the channels' ratios: a shadow's at most, and more than any shadow's
BOUNCE = 0.35  # of the object's tint: as much of its own colour it throws into its shadow
LEAST_ATTACHED, MOST_ATTACHED = 0.35, 0.65  # share of the rim that lies on the object: half, for a strip beside it
STRONGER = 1.1  # the object's edge against the shadow's edge towards the light
PENUMBRA_PX = 1.5  # a perfect edge is 1.05 wide under the gradient's blur, and a light of some extent widens a shadow's
ALL_NARROW = 0.9
"""Of the edge towards the light: near its foot a shadow is as sharp as a thing, a thing is so all along."""
LEAST_PIXELS = 5e-5  # of the picture: smaller strips than this are left to the graph cut
STEEPNESS = 5.0  # an edge as strong as ``edge`` costs exp(-5) of what flat ground costs
FLAT_COST = 10_000  # capacities are whole numbers


@dataclass(frozen=True)
class _Evidence:
    """Measures of a region: shares, edges in L*a*b* per pixel, and the width of the edge towards the light in pixels.

    ``narrow`` is the share of that edge that is as narrow as the photo's own edges.
    """

    attached: float
    object_edge: float
    light_edge: float
    light_width_px: float
    narrow: float
    shaded: float
    falling: float
    loose: float


def hard_shadow(background: Background, solid: np.ndarray, gradient: np.ndarray, narrow: np.ndarray) -> np.ndarray:
    """Return the parts (H, W) of ``solid`` that are a cast shadow with a visible edge.

    A minimum cut parts the outside from what has other colours than a shadow. What the outside gets of ``solid`` is shadow
    where it has the background's colour dimmed, lies along the object, ends there at a stronger edge than towards the
    light, and where the light falls off over more than a sharp edge's width and goes on falling. Grey parts of an object have
    a sharp outline, or lie apart, or hold lights and pieces of it.
    """
    found = np.zeros(solid.shape, bool)
    ratio, light = background.light_ratio, background.light
    dim = (light > MIN_LIGHT) & (light < MAX_SHADE)
    tint = _tint(ratio, light, solid)
    falling = falls_inward(light, ~solid)
    certain = opened(solid & ~(dim & falling & (tint < CERTAIN_TINT)) & (background.distance > 4), 1)
    if not certain.any():
        return found
    sharp = cv2.dilate(gradient, disk(4))
    reached = cut_along_edges(~solid, certain, gradient, max(float(np.median(sharp[certain])), 1.0))
    contrast = length(background.residual)
    count, labels = cv2.connectedComponents(opened(reached, 1).astype(np.uint8), connectivity=4)
    for index in range(1, count):
        region = labels == index
        if region.sum() >= LEAST_PIXELS * solid.size:
            evidence = _evidence(
                region, solid, reached, sharp, contrast, dim & (tint < TINT), falling, dilated(narrow, 3)
            )
            if _is_shadow(evidence):
                found |= dilated(region, 1) & reached
    return found


def edge_width_px(depth: np.ndarray, steepest: np.ndarray) -> np.ndarray:
    """Return the standard deviation of the Gaussian that blurs a step of ``depth`` to a gradient of ``steepest``."""
    return np.asarray(depth / (np.sqrt(2 * np.pi) * np.maximum(steepest, 1e-6)))


def _is_shadow(evidence: _Evidence) -> bool:
    return (
        LEAST_ATTACHED < evidence.attached < MOST_ATTACHED
        and evidence.object_edge > STRONGER * evidence.light_edge
        and evidence.light_width_px > PENUMBRA_PX
        and evidence.narrow < ALL_NARROW
        and evidence.shaded > 0.55
        and evidence.falling > 0.98
        and evidence.loose < 0.03
    )


def _tint(ratio: np.ndarray, light: np.ndarray, solid: np.ndarray) -> np.ndarray:
    """Return how far the light (H, W) of each pixel is from that of the background, dimmed evenly.

    What goes towards the object's own tint may be light that it throws into its shadow: ``BOUNCE`` of it counts as ``TINT``.
    """
    even = light[..., None]
    left = (ratio - even) / np.maximum(even, 0.3) / np.sqrt(3)
    size = length(left)
    coloured = solid & (size > CERTAIN_TINT)
    if not coloured.any():
        return np.asarray(size)
    own = np.median(left[coloured], axis=0)
    own_size = max(float(np.linalg.norm(own)), 1e-6)
    along = left @ (own / own_size)
    across = length(left - np.maximum(along, 0)[..., None] * (own / own_size))
    return np.asarray(np.maximum(across, along * (TINT / (BOUNCE * own_size))))


def _evidence(
    region: np.ndarray,
    solid: np.ndarray,
    reached: np.ndarray,
    sharp: np.ndarray,
    contrast: np.ndarray,
    shaded: np.ndarray,
    falling: np.ndarray,
    near_narrow: np.ndarray,
) -> _Evidence:
    near = dilated(region, 3) & ~region
    to_object, to_light = near & solid & ~reached, near & ~solid
    if not to_object.any() or not to_light.any():
        return _Evidence(0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0)
    inner = eroded(region, 2)
    depth = float(np.median(contrast[inner if inner.any() else region]))
    light_edge = float(np.median(sharp[to_light]))
    whole = cv2.morphologyEx(region.astype(np.uint8), cv2.MORPH_CLOSE, disk(5)) > 0
    return _Evidence(
        attached=float(to_object.sum() / (to_object.sum() + to_light.sum())),
        object_edge=float(np.percentile(sharp[to_object], 25)),
        light_edge=light_edge,
        light_width_px=float(edge_width_px(np.array(depth), np.array(light_edge))),
        narrow=float(near_narrow[to_light].mean()),
        shaded=float(shaded[region].mean()),
        falling=float(falling[whole & solid].mean()),
        loose=_loose_share(solid, region),
    )


def _loose_share(solid: np.ndarray, region: np.ndarray) -> float:
    """Return how much comes off ``solid`` where ``region`` goes, as a share of it; all where it is the greater part."""
    if 2 * region.sum() > solid.sum():
        return 1.0
    before, _ = cv2.connectedComponents(solid.astype(np.uint8), connectivity=4)
    _, _, stats, _ = cv2.connectedComponentsWithStats((solid & ~region).astype(np.uint8), connectivity=4)
    sizes = np.sort(stats[1:, cv2.CC_STAT_AREA])[::-1]
    return float(sizes[before - 1 :].sum() / region.sum())


def cut_along_edges(outside: np.ndarray, inside: np.ndarray, gradient: np.ndarray, edge: float) -> np.ndarray:
    """Return what ``outside`` gets of the pixels (H, W) that are neither, when both are parted where it costs least.

    A cut between two pixels costs exp(-5 g / edge) of their gradient g (Boykov and Jolly 2001, without colours), so it runs
    along the edges that are strongest on the whole, and a weak spot in one does not let the other side through.
    """
    free = ~outside & ~inside
    node = np.where(outside, 0, 1)
    node[free] = 2 + np.arange(int(free.sum()))
    ends, costs = [], []
    for first, second in (((slice(None, -1),), (slice(1, None),)), (np.s_[:, :-1], np.s_[:, 1:])):
        a, b = node[first], node[second]
        used = (a != b) & (np.maximum(a, b) > 1)
        steepest = np.maximum(gradient[first], gradient[second])[used]
        ends.append(np.stack([a[used], b[used]]))
        costs.append(1 + FLAT_COST * np.exp(-STEEPNESS * steepest / edge))
    pairs, cost = np.concatenate(ends, axis=1), np.round(np.concatenate(costs))
    both = np.concatenate([pairs, pairs[::-1]], axis=1)
    size = 2 + int(free.sum())
    # entries of one pair add up: a pixel may touch a terminal on several sides
    graph = coo_matrix((np.concatenate([cost, cost]), both), shape=(size, size)).tocsr().astype(np.int32)
    left = graph - maximum_flow(graph, 0, 1).flow
    left.eliminate_zeros()
    reached = np.zeros(size, bool)
    reached[breadth_first_order(left, 0, return_predecessors=False)] = True
    return np.asarray(reached[node] & free)
