"""Hard cast shadows: strips beside an object at which the soft flood stops, told from grey parts by their boundaries."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

from manitwin.models.matting.background import MAX_SHADE, Background, length
from manitwin.models.matting.outline import dilated, disk, eroded, opened
from manitwin.models.matting.shadow import falls_inward

MIN_LIGHT = 0.10  # of the background's light: darker pixels carry no colour information
TINT, CERTAIN_TINT = 0.10, 0.20  # spread of the channels' ratios: maximum of a shadow, and more than any shadow has
BOUNCE = 0.35  # share of the object's tint that it may reflect into its shadow
LEAST_ATTACHED, MOST_ATTACHED = 0.35, 0.65  # share of the rim that lies on the object; a strip beside it has about half
STRONGER = 1.1  # minimum ratio of the object's edge to the shadow's edge towards the light
PENUMBRA_PX = (
    1.5  # a perfect edge is 1.05 px wide under the gradient's blur; an extended light source widens a shadow's edge
)
ALL_NARROW = 0.9
"""Share of the edge towards the light. A shadow is as sharp as an object near its foot only, an object all along."""
LEAST_PIXELS = 5e-5  # of the picture: smaller strips are left to the graph cut
STEEPNESS = 5.0  # cutting an edge as strong as ``edge`` costs exp(-5) of the cost on flat background
FLAT_COST = 10_000  # capacities are integers


@dataclass(frozen=True)
class _Evidence:
    """Measurements of a region: shares, edges in L*a*b* per pixel, and the width of the edge towards the light in pixels.

    ``narrow`` is the share of that edge that is as narrow as the photo's own edges. ``loose`` is the area that would be
    disconnected from the object if the region were removed, relative to the region.
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

    A minimum cut separates the outside from pixels whose colours are no shadow's. A region of ``solid`` on the outside's part
    is shadow if it has the dimmed background colour, lies along the object, has a stronger edge towards the object than
    towards the light, has an edge towards the light that is wider than a sharp edge, and keeps getting darker inward. Grey
    parts of an object have a sharp outline, or lie apart, or contain highlights and pieces of the object.
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
    """Return the standard deviation in pixels of the Gaussian that blurs a step of ``depth`` to the gradient ``steepest``."""
    return np.asarray(depth / (np.sqrt(2 * np.pi) * np.maximum(steepest, 1e-6)))


def _is_shadow(evidence: _Evidence) -> bool:
    """Tell whether the measurements of a region are those of a shadow."""
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
    """Return the deviation (H, W) of each pixel's light from that of the evenly dimmed background.

    A deviation towards the object's own tint may be light reflected into the shadow: ``BOUNCE`` of the object's tint counts
    as ``TINT``.
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
    """Measure a region; without an edge to both object and light the result is never a shadow."""
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
    """Return the area that removing ``region`` disconnects from ``solid``, over the area of the region.

    It is 1 if the region is the greater part of ``solid``.
    """
    if 2 * region.sum() > solid.sum():
        return 1.0
    before, _ = cv2.connectedComponents(solid.astype(np.uint8), connectivity=4)
    _, _, stats, _ = cv2.connectedComponentsWithStats((solid & ~region).astype(np.uint8), connectivity=4)
    sizes = np.sort(stats[1:, cv2.CC_STAT_AREA])[::-1]
    return float(sizes[before - 1 :].sum() / region.sum())


def cut_along_edges(outside: np.ndarray, inside: np.ndarray, gradient: np.ndarray, edge: float) -> np.ndarray:
    """Assign the undecided pixels (H, W) to ``outside`` or ``inside`` by a minimum cut; return those that go to ``outside``.

    A cut between two pixels costs exp(-5 g / edge) of their gradient g (Boykov and Jolly 2001, without colour terms), so it
    follows the strongest edges overall, and a weak spot in an edge does not let the other side through.
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
    # entries of the same pair are summed: a pixel may touch a terminal on several sides
    graph = coo_matrix((np.concatenate([cost, cost]), both), shape=(size, size)).tocsr().astype(np.int32)
    left = graph - maximum_flow(graph, 0, 1).flow
    left.eliminate_zeros()
    reached = np.zeros(size, bool)
    reached[breadth_first_order(left, 0, return_predecessors=False)] = True
    return np.asarray(reached[node] & free)
