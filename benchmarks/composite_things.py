"""Objects of composites: rendered templates and their positions in the picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from composite_categories import COMPOSITE_CATEGORIES

from manitwin.errors import ManiTwinError
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import ObjectDescription
from manitwin.models.generators.templates.look_phrases import LookRequest
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.models.generators.templates.template_object import visual_parts
from manitwin.render.cameras import Camera, framing_camera
from manitwin.render.renderer import shared_renderer

Part = Literal["tuning", "held-out", "calibration", "training"]
Kind = Literal["single", "cut", "several"]

WIDTH_PX, HEIGHT_PX = 640, 512
UNSEEN = 4  # one of this many categories is in no training picture
FLAT = 0.3  # height over footprint below which a thing lies and is photographed from above
CLEAR = ("glass", "wine glass", "glass bottle", "jar", "vase", "bottle", "water bottle", "measuring cup")


@dataclass(frozen=True)
class Thing:
    """A thing seen by ``camera``.

    ``rgb`` is linear light multiplied by ``coverage``; the vertices ``(N, 3)`` and the faces are in the object frame.
    """

    rgb: np.ndarray
    coverage: np.ndarray
    vertices: np.ndarray
    faces: np.ndarray
    camera: Camera
    category: str
    clear: bool


def is_unseen(category: str) -> bool:
    """Tell whether a category is kept out of the training part."""
    return COMPOSITE_CATEGORIES.index(category) % UNSEEN == 0


def draw_thing(rng: np.random.Generator, beside: Thing | None, part: Part) -> Thing:
    """Render a template in drawn colours, at the camera elevation of ``beside`` if it is given."""
    templates = load_templates()
    names = [name for name in COMPOSITE_CATEGORIES if part != "training" or not is_unseen(name)]
    while True:
        category = names[int(rng.integers(len(names)))]
        wish = LookRequest(rgb=tuple(rng.uniform(0.03, 0.97, 3))) if rng.random() < 0.3 else LookRequest()  # type: ignore[arg-type]
        try:
            made = make_object(templates[category], ObjectDescription(category, {"": wish}), rng)
        except ManiTwinError:
            continue
        break
    parts = visual_parts(made)
    vertices = made.mesh.vertices
    extents = np.ptp(vertices, axis=0)
    flat = extents[2] < FLAT * extents[:2].max()
    elevation = float(rng.uniform(40, 89) if flat else rng.triangular(3, 18, 60))
    camera = framing_camera(
        vertices,
        azimuth_deg=float(rng.uniform(0, 360)),
        elevation_deg=elevation if beside is None else _elevation_deg(beside.camera),
        fov_y_deg=float(rng.uniform(18, 45)),
        width_px=WIDTH_PX,
        height_px=HEIGHT_PX,
    )
    frame = shared_renderer().render(parts, [camera], background=(0, 0, 0))[0]
    rgb = premultiplied(frame.rgb, frame.coverage) * np.float32(rng.uniform(0.75, 1.15))
    rgb *= _printed(rng, frame.coverage) * _sided(rng)[None, :, None]
    clear = category in CLEAR and rng.random() < 0.5
    return Thing(rgb, frame.coverage, vertices, made.mesh.faces, camera, category, clear)


def _elevation_deg(camera: Camera) -> float:
    return float(np.rad2deg(np.arcsin(np.clip(camera.camera_to_object[2, 2], -1, 1))))


def _printed(rng: np.random.Generator, coverage: np.ndarray) -> np.ndarray:
    """Return colour factors ``(H, W, 3)`` of a print, a label or a pattern on half of the things, and 1 elsewhere."""
    factors = np.full((*coverage.shape, 3), 100, np.uint8)  # in percent
    if rng.random() < 0.5:
        return np.ones(factors.shape, np.float32)
    ys, xs = np.nonzero(coverage > 0.5)
    if not len(xs):
        return factors
    low, high = np.array([xs.min(), ys.min()]), np.array([xs.max(), ys.max()])
    for _ in range(int(rng.integers(1, 5))):
        at = low + rng.uniform(0.1, 0.9, 2) * (high - low)
        size = rng.uniform(0.05, 0.35, 2) * (high - low)
        color = tuple(float(c) for c in rng.uniform(10, 160, 3))
        if rng.random() < 0.5:
            box = cv2.boxPoints((at.tolist(), size.tolist(), float(rng.uniform(-20, 20)))).astype(np.int32)
            cv2.fillConvexPoly(factors, box, color, lineType=cv2.LINE_AA)
        else:
            word = "".join(chr(int(c)) for c in rng.integers(65, 91, 5))
            cv2.putText(factors, word, at.astype(int).tolist(), 0, float(rng.uniform(0.5, 2.5)), color, 3, cv2.LINE_AA)
    return factors.astype(np.float32) / 100


def _sided(rng: np.random.Generator) -> np.ndarray:
    """Return a brightness ``(W,)`` that increases towards one side."""
    return np.linspace(1, float(rng.uniform(0.7, 1.4)), WIDTH_PX, dtype=np.float32)


def place_of(rng: np.random.Generator, thing: Thing, kind: Kind, scale: float | None = None) -> np.ndarray:
    """Return the affine map ``(2, 3)`` from the thing's own picture to the composite."""
    ys, xs = np.nonzero(thing.coverage > 0.5)
    low, high = np.array([xs.min(), ys.min()]), np.array([xs.max(), ys.max()]) + 1
    size = np.array([WIDTH_PX, HEIGHT_PX])
    scale = float(rng.uniform(0.4, 1.0)) if scale is None else scale
    room = size - scale * (high - low)
    corner = rng.uniform(0.05, 0.95, 2) * room
    if kind == "cut":
        side, share = int(rng.integers(4)), float(rng.uniform(0.15, 0.6))
        axis = side % 2
        extent = scale * (high - low)[axis]
        corner[axis] = -share * extent if side < 2 else size[axis] - (1 - share) * extent
    return np.array([[scale, 0, corner[0] - scale * low[0]], [0, scale, corner[1] - scale * low[1]]])


def overlaps(things: list[Thing], placements: list[np.ndarray], other: Thing, placement: np.ndarray) -> bool:
    """Tell whether a thing would come within 12 pixels of the things already placed."""
    size = (WIDTH_PX, HEIGHT_PX)
    mask = cv2.dilate(cv2.warpAffine(other.coverage, placement, size), np.ones((25, 25))) > 0.1
    return any(
        bool((mask & (cv2.warpAffine(t.coverage, p, size) > 0.1)).any())
        for t, p in zip(things, placements, strict=True)
    )


def premultiplied(rgb: np.ndarray, coverage: np.ndarray) -> np.ndarray:
    """Return the linear light ``(H, W, 3)`` of the thing in each pixel, multiplied by its ``coverage (H, W)``.

    ``rgb (H, W, 3) uint8`` is sRGB averaged with a black background. Converting it to linear light directly would give every
    thing a dark fringe.
    """
    share = np.maximum(coverage, 1 / 255)[..., None]
    return linear(np.rint(np.minimum(rgb / share, 255)).astype(np.uint8)) * coverage[..., None]


def linear(rgb: np.ndarray) -> np.ndarray:
    """Return sRGB values ``(..., 3)`` uint8 as linear light."""
    return np.asarray(_LINEAR[rgb])


# IEC 61966-2-1
_LINEAR = np.array(
    [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in np.arange(256) / 255], np.float32
)
