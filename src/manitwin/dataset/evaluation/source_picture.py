"""The input of a twin, a segmented photo or a text, with its comparison by silhouette and image features."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from manitwin.config import MattingConfig
from manitwin.dataset.evaluation.thirty_views import SIDE_PX, WHITE, View
from manitwin.errors import InputError, Rejected
from manitwin.models.classifiers.efficientnet_lite import features
from manitwin.models.embedders.appearance import MARGIN, NETWORK, center_object
from manitwin.models.matting import matte_photo
from manitwin.pipeline.photo_pixels import pixels_of_photo
from manitwin.pipeline.stated_place import as_box
from manitwin.twin.loaded_twin import Twin

OUTLINE_PX, OUTLINE_RADIUS = 96, 20.0
"""Silhouettes are compared in squares of this side, scaled to the area of a disc of this radius (pixels)."""
TURNS = 24
"""Rotations in the image plane: the orientation of objects seen from above is unknown."""


@dataclass(frozen=True)
class Source:
    """The input of a twin: an ``image`` with the ``rgb`` and ``mask`` of its foreground, or a ``text``.

    ``left_out`` says why an image is not compared.
    """

    kind: str
    sha256: str
    text: str = ""
    rgb: np.ndarray | None = None
    mask: np.ndarray | None = None
    left_out: str = ""

    @property
    def on_white(self) -> np.ndarray:
        """The object centred on a white square ``(224, 224, 3) uint8``, as large as in the views."""
        assert self.rgb is not None and self.mask is not None
        rows, columns = np.flatnonzero((self.mask > 0.5).any(1)), np.flatnonzero((self.mask > 0.5).any(0))
        middle = (columns[0] + columns[-1] + 1) / 2, (rows[0] + rows[-1] + 1) / 2
        side = (1 + 2 * MARGIN) * max(columns[-1] + 1 - columns[0], rows[-1] + 1 - rows[0])
        scale = SIDE_PX / side
        move = np.array([[scale, 0, SIDE_PX / 2 - scale * middle[0]], [0, scale, SIDE_PX / 2 - scale * middle[1]]])
        share = self.mask.astype(np.float32)[..., None]
        bare = (self.rgb * share + WHITE * (1 - share)).astype(np.float32)
        if scale < 0.5:  # warping without prior blur would alias
            bare = np.asarray(cv2.blur(bare, (max(1, round(1 / scale)),) * 2), np.float32)
        shown = cv2.warpAffine(bare, move, (SIDE_PX, SIDE_PX), borderValue=(WHITE,) * 3)
        return np.rint(np.clip(shown, 0, 255)).astype(np.uint8)


def load_source(twin: Twin) -> Source | None:
    """Return the input that a twin was generated from; None for a mesh, from which nothing is generated.

    A photo is segmented again with the default settings of a build.
    """
    source = twin.record.source
    if source.kind == "text":
        return Source("text", source.sha256, text=source.prompt or "")
    if source.kind == "photos":
        return Source("image", source.sha256, left_out="several photos in one archive: none is the input")
    if source.kind != "image":
        return None
    settings = MattingConfig()
    try:
        photo = pixels_of_photo(
            twin.folder / source.file,
            None if twin.record.naming else twin.record.name,
            settings,
            mask=None if source.mask is None else twin.folder / source.mask,
            box_px=as_box(source.box_px or ()),
        )
        rgba = matte_photo(photo.given.pixels, source.file, working_side_px=settings.working_side_px).rgba
    except (Rejected, InputError) as error:
        return Source("image", source.sha256, left_out=f"its photo cannot be cut out by default settings: {error}")
    return Source("image", source.sha256, rgb=rgba[..., :3], mask=rgba[..., 3].astype(np.float32) / 255)


def image_feature(rgb: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return the unit vector ``(1280,)`` of EfficientNet-Lite0 features of an object on grey; raises Unavailable."""
    vector = features(center_object(rgb, mask)[0][None])[0, -NETWORK:].astype(np.float64)
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-9))


def normalize_silhouette(mask: np.ndarray, turn_rad: float = 0.0) -> np.ndarray:
    """Return the silhouette ``(96, 96) bool`` of a mask ``(H, W)`` in 0..1, centred, scaled to a fixed area, and rotated."""
    inside = (mask > 0.5).astype(np.float32)
    area = float(inside.sum())
    rows, columns = np.nonzero(inside)
    scale = OUTLINE_RADIUS * np.sqrt(np.pi / area)
    cosine, sine = scale * np.cos(turn_rad), scale * np.sin(turn_rad)
    linear = np.array([[cosine, -sine], [sine, cosine]])
    middle = np.array([OUTLINE_PX / 2 - 0.5] * 2) - linear @ np.array([columns.mean(), rows.mean()])
    if scale < 0.5:
        inside = np.asarray(cv2.blur(inside, (max(1, round(1 / scale)),) * 2), np.float32)
    return np.asarray(cv2.warpAffine(inside, np.column_stack([linear, middle]), (OUTLINE_PX, OUTLINE_PX)) > 0.5)


def best_silhouette_iou(mask: np.ndarray, views: Sequence[View]) -> tuple[float, int]:
    """Return the largest silhouette IoU of a mask with the views over all rotations, and the index of the best view."""
    turned = np.array(
        [normalize_silhouette(mask, 2 * np.pi * turn / TURNS).ravel() for turn in range(TURNS)], np.float32
    )
    seen = np.array([normalize_silhouette(view.coverage).ravel() for view in views], np.float32)
    both = turned @ seen.T
    shares = both / (turned.sum(1)[:, None] + seen.sum(1)[None] - both)
    best = shares.max(0)
    return float(best.max()), int(best.argmax())
