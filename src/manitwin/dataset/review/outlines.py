"""``manitwin review cutouts --draw``: people draw the outlines of things whose cut-outs were doubted, and these are built."""

from __future__ import annotations

import io
import threading
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Unpack

import numpy as np
from PIL import Image

from manitwin.config import MattingConfig
from manitwin.dataset.review.cutouts import DoubtedPhoto, photos_to_draw
from manitwin.dataset.review.making_again import made_again
from manitwin.engine.amendments import read_amendments, write_amendments
from manitwin.engine.drive import RunOptions, RunReport
from manitwin.errors import InputError, Rejected, UsageError
from manitwin.models.matting.fitted_outline import fit_outline
from manitwin.models.matting.matte import matte_photo
from manitwin.pipeline.cutout import CONFIRMED, CUTOUT, QUALITY, SHOWN_PX, reduced
from manitwin.pipeline.drawn_outline import (
    DRAWN,
    DrawnOutline,
    as_drawn,
    drawn_outline,
    mask_of_png,
    why_no_outline,
)
from manitwin.pipeline.given_alpha import Given
from manitwin.pipeline.human_corrections import HUMAN
from manitwin.pipeline.item import Item, masks_of
from manitwin.pipeline.photo import PhotoStage
from manitwin.pipeline.photo_pixels import pixels_of_photo
from manitwin.pipeline.settings import stored_config
from manitwin.pipeline.stated_place import as_box
from manitwin.twin.dataset_root import DatasetRoot


class OutlineSession:
    """The photos of a data set that ``photos_to_draw`` returns, what each shows, and the outlines that ``annotator`` draws.

    What is kept is in the data set's amendments at once; ``build`` makes the twins. Raises UsageError as that does.
    """

    def __init__(self, root: DatasetRoot, annotator: str, redraw: Iterable[str] = ()):
        self.root, self.annotator = root, annotator
        self.photos = {photo.twin_id: photo for photo in photos_to_draw(root, redraw)}
        self._settings = stored_config(root).matting
        self._looked_at: dict[str, np.ndarray] = {}
        self._kept: dict[str, None] = {}
        self._lock = threading.Lock()

    @property
    def kept(self) -> tuple[str, ...]:
        """The ids of the photos whose outlines were kept, in that order."""
        return tuple(self._kept)

    def photo(self, twin_id: str) -> DoubtedPhoto:
        """Return a doubted photo; raises UsageError where there is none of this id."""
        if twin_id not in self.photos:
            raise UsageError(f"{twin_id}: no photo here whose cut-out is doubted")
        return self.photos[twin_id]

    def picture(self, twin_id: str) -> bytes:
        """Return what is looked at of a photo, as a WebP file."""
        encoded = io.BytesIO()
        Image.fromarray(self._rgba(twin_id)[..., :3]).save(encoded, "WEBP", quality=QUALITY, method=4)
        return encoded.getvalue()

    def mask(self, twin_id: str) -> bytes:
        """Return its outline as a PNG file of the same size, white where the thing is: what was drawn, else what is doubted."""
        rgba = self._rgba(twin_id)
        drawn = drawn_outline(read_amendments(self.root, twin_id).get(PhotoStage.name, {}), twin_id)
        same = drawn is not None and drawn.mask.shape == rgba.shape[:2]
        return _png(drawn.mask if drawn is not None and same else rgba[..., 3] > 127)

    def fitted(self, twin_id: str, png: bytes) -> bytes:
        """Return an outline (PNG) moved onto edges near it, as PNG; raises UsageError for what is no outline of the photo."""
        rgba = self._rgba(twin_id)
        with self._lock:  # OpenCV's random numbers are the process's
            return _png(fit_outline(rgba[..., :3], self._mask(png, rgba)))

    def keep(self, twin_id: str, png: bytes) -> None:
        """Keep an outline for every later build; raises UsageError where nothing, or no one thing, can be cut out by it."""
        photo, rgba = self.photo(twin_id), self._rgba(twin_id)
        drawn = DrawnOutline(self._mask(png, rgba), f"{HUMAN}{self.annotator}")
        if (why := why_no_outline(drawn.mask)) is not None:
            raise UsageError(f"not kept: the outline {why}; draw it around the thing")
        try:
            matte_photo(
                as_drawn(Given(rgba[..., :3]), drawn, "this photo").pixels,
                "this photo",
                min_area_share=self._settings.min_area_share,
                second_object_share=self._settings.second_object_share,
            )
        except Rejected as error:
            raise UsageError(f"not kept: {error.detail}") from error
        amendments = read_amendments(self.root, photo.twin_id)
        said = amendments.setdefault(PhotoStage.name, {})
        said.pop(CONFIRMED, None)
        said[DRAWN] = drawn.to_json()
        write_amendments(self.root, photo.twin_id, amendments)
        self._kept[photo.twin_id] = None

    def build(self, *, jobs: int | None = None, **options: Unpack[RunOptions]) -> RunReport:
        """Build the photos whose outlines were kept; raises UsageError where another run is at work there."""
        chosen: Sequence[DoubtedPhoto] = [self.photos[twin_id] for twin_id in self._kept]
        return made_again(self.root, ((each.number, each.item) for each in chosen), jobs, **options)

    def _rgba(self, twin_id: str) -> np.ndarray:
        photo = self.photo(twin_id)
        if photo.sha256 is None:
            with self._lock:
                if twin_id not in self._looked_at:
                    self._looked_at[twin_id] = _seen_again(photo.item, self._settings)
            return self._looked_at[twin_id]
        name = f"{self.root.twin_name(twin_id)}/{CUTOUT}"
        with Image.open(io.BytesIO(self.root.read_bytes(name, UsageError))) as picture:
            return np.asarray(picture.convert("RGBA"))

    def _mask(self, png: bytes, rgba: np.ndarray) -> np.ndarray:
        try:
            mask = mask_of_png(png)
        except ValueError as error:
            raise UsageError(f"what was sent is no outline: {error}") from error
        if mask.shape != rgba.shape[:2]:
            raise UsageError(
                f"an outline of {mask.shape[1]} x {mask.shape[0]} pixels is none of this photo; reload the page"
            )
        return mask


def _seen_again(item: Item, settings: MattingConfig) -> np.ndarray:
    """Return a photo ``(H, W, 4) uint8`` as ``shown_cutout`` would show it, cut out without more networks, empty if that fails.

    Raises UsageError where the photo cannot be read any more.
    """
    path, mask, box_px = Path(item.file or ""), next(iter(masks_of(item))), as_box(item.box_px)
    stage = PhotoStage(settings)
    try:
        rgba, _ = stage.cut_out(path, item.name, lambda doubted: doubted.matte, mask=mask, box_px=box_px)
    except InputError as error:
        raise UsageError(f"{path}: cannot be looked at: {error.detail}") from error
    except Rejected:
        pixels = pixels_of_photo(path, item.name, settings, mask=mask, box_px=box_px).given.pixels
        rgba = np.dstack([pixels[..., :3], np.zeros(pixels.shape[:2], np.uint8)])
    return reduced(rgba, SHOWN_PX)


def _png(mask: np.ndarray) -> bytes:
    encoded = io.BytesIO()
    Image.fromarray(np.where(mask, 255, 0).astype(np.uint8)).save(encoded, "PNG")
    return encoded.getvalue()
