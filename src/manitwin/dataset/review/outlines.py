"""``manitwin review cutouts --draw``: people draw outlines of things whose cut-outs were doubted, and say what these are."""

from __future__ import annotations

import io
import threading
from collections.abc import Iterable
from dataclasses import replace
from typing import Unpack

import numpy as np
from PIL import Image

from manitwin.config import MattingConfig
from manitwin.dataset.review.cutouts import DoubtedPhoto, photos_to_draw
from manitwin.dataset.review.making_again import made_again
from manitwin.dataset.review.said_words import Words, read_name, read_side_cm, with_words, words_of
from manitwin.engine.amendments import Amendments, read_amendments, write_amendments
from manitwin.engine.drive import RunOptions, RunReport
from manitwin.errors import InputError, Rejected, UsageError
from manitwin.models.matting.fitted_outline import fit_outline
from manitwin.models.matting.matte import matte_photo
from manitwin.pipeline.cutout import CONFIRMED, CUTOUT, QUALITY, SHOWN_PX, reduced
from manitwin.pipeline.drawn_outline import (
    DrawnOutline,
    as_drawn,
    drawn_outline,
    mask_of_png,
    why_no_outline,
    with_outline,
)
from manitwin.pipeline.given_alpha import Given
from manitwin.pipeline.human_corrections import HUMAN
from manitwin.pipeline.item import masks_of
from manitwin.pipeline.photo import PhotoStage
from manitwin.pipeline.photo_pixels import pixels_of_photo
from manitwin.pipeline.settings import stored_config
from manitwin.pipeline.stated_place import as_box
from manitwin.twin.dataset_root import DatasetRoot


class OutlineSession:
    """The photos of a data set that ``photos_to_draw`` returns, what each shows, and what ``annotator`` draws and says of them.

    What is kept is in the data set's amendments at once; ``build`` makes the twins. Photos go by their ``key``. Raises UsageError
    as ``photos_to_draw`` does.
    """

    def __init__(self, root: DatasetRoot, annotator: str, redraw: Iterable[str] = ()):
        self.root, self.annotator = root, annotator
        self.photos = {photo.key: photo for photo in photos_to_draw(root, redraw)}
        config = stored_config(root)
        self._settings, self._gate = config.matting, config.gate
        self._looked_at: dict[str, np.ndarray] = {}
        self._kept: dict[str, None] = {}
        self._said: dict[str, None] = {}
        self._lock, self._writing = threading.Lock(), threading.Lock()

    @property
    def kept(self) -> tuple[str, ...]:
        """The photos whose outlines were kept, in that order."""
        return tuple(self._kept)

    @property
    def said(self) -> tuple[str, ...]:
        """The ids of the twins whose name or size was said anew, in that order."""
        return tuple(self._said)

    def photo(self, key: str) -> DoubtedPhoto:
        """Return a doubted photo; raises UsageError where there is none of this key."""
        if key not in self.photos:
            raise UsageError(f"{key}: not a photo with a doubtful cut-out; reload the list")
        return self.photos[key]

    def words(self, key: str) -> Words:
        """Return what is said of the photo's thing now."""
        photo = self.photo(key)
        return words_of(photo.item, read_amendments(self.root, photo.twin_id))

    def picture(self, key: str) -> bytes:
        """Return what is looked at of a photo, as a WebP file."""
        encoded = io.BytesIO()
        Image.fromarray(self._rgba(key)[..., :3]).save(encoded, "WEBP", quality=QUALITY, method=4)
        return encoded.getvalue()

    def mask(self, key: str) -> bytes:
        """Return its outline as a PNG file of the same size, white where the thing is: what was drawn, else what is doubted."""
        photo, rgba = self.photo(key), self._rgba(key)
        drawn = drawn_outline(read_amendments(self.root, photo.twin_id).get(PhotoStage.name, {}), key, photo.place)
        same = drawn is not None and drawn.mask.shape == rgba.shape[:2]
        return _png(drawn.mask if drawn is not None and same else rgba[..., 3] > 127)

    def fitted(self, key: str, png: bytes) -> bytes:
        """Return an outline (PNG) moved onto edges near it, as PNG; raises UsageError for what is no outline of the photo."""
        rgba = self._rgba(key)
        with self._lock:  # OpenCV's random numbers are the process's
            return _png(fit_outline(rgba[..., :3], self._mask(png, rgba)))

    def keep(self, key: str, png: bytes | None, name: object = None, longest_side_cm: object = None) -> None:
        """Keep an outline (PNG), a name and a longest side (cm) for every later build; what is None stays as it is.

        Raises UsageError, and keeps nothing, where no one thing can be cut out by the outline, for what is no name or length, and
        where the picture is looked at otherwise under the name.
        """
        photo, source = self.photo(key), f"{HUMAN}{self.annotator}"
        drawn = None if png is None else self._drawn(key, png, source)
        with self._writing:
            before = read_amendments(self.root, photo.twin_id)
            now = words_of(photo.item, before)
            words = Words(
                now.name if name is None else read_name(name),
                now.longest_side_cm if longest_side_cm is None else read_side_cm(longest_side_cm, self._gate),
            )
            after = with_words(before, photo.item, words, source)
            if drawn is not None:
                said = {key: each for key, each in after.get(PhotoStage.name, {}).items() if key != CONFIRMED}
                after[PhotoStage.name] = with_outline(said, drawn, photo.place)
            if {words.name, now.name} != {photo.item.name or ""}:
                is_renamed = words.name != now.name and photo.place is not None
                for place in range(len(photo.item.files)) if is_renamed else (photo.place,):
                    self._require_same_picture(replace(photo, place=place), words.name, after)
            if after != before:
                write_amendments(self.root, photo.twin_id, after)
            if words_of(photo.item, after) != now:
                self._said[photo.twin_id] = None
            if drawn is not None:
                self._kept[key] = None

    def build(self, *, jobs: int | None = None, **options: Unpack[RunOptions]) -> RunReport:
        """Build what was drawn or said anew; raises UsageError where another run is at work there."""
        by_twin = {photo.twin_id: photo for photo in self.photos.values()}
        changed = dict.fromkeys((*(self.photos[key].twin_id for key in self._kept), *self._said))
        chosen = [by_twin[twin_id] for twin_id in changed]
        return made_again(self.root, ((each.number, each.item) for each in chosen), jobs, **options)

    def _drawn(self, key: str, png: bytes, source: str) -> DrawnOutline:
        rgba = self._rgba(key)
        drawn = DrawnOutline(self._mask(png, rgba), source)
        if (why := why_no_outline(drawn.mask)) is not None:
            raise UsageError(f"not kept: the outline {why}; draw it around the object")
        try:
            matte_photo(
                as_drawn(Given(rgba[..., :3]), drawn, "this photo").pixels,
                "this photo",
                min_area_share=self._settings.min_area_share,
                second_object_share=self._settings.second_object_share,
            )
        except Rejected as error:
            raise UsageError(f"not kept: {error.detail}") from error
        return drawn

    def _require_same_picture(self, photo: DoubtedPhoto, name: str, amendments: Amendments) -> None:
        """Raise UsageError where an outline is of another part of the picture than is looked at under a name."""
        drawn = drawn_outline(amendments.get(PhotoStage.name, {}), photo.key, photo.place)
        if drawn is None:
            return
        pixels = _pixels(photo, name or photo.item.name, self._settings)
        if not drawn.is_of(pixels.shape[:2]):
            raise UsageError(
                f"not kept: as a {name!r} the picture is looked at without its frame, and the outline is of the whole; keep the"
                " name alone, end the command, and draw the outline after that"
            )

    def _rgba(self, key: str) -> np.ndarray:
        photo = self.photo(key)
        if photo.sha256 is None:
            with self._lock:
                if key not in self._looked_at:
                    self._looked_at[key] = _seen_again(photo, self.words(key).name, self._settings)
            return self._looked_at[key]
        name = f"{self.root.twin_name(photo.twin_id)}/{CUTOUT}"
        with Image.open(io.BytesIO(self.root.read_bytes(name, UsageError))) as picture:
            return np.asarray(picture.convert("RGBA"))

    def _mask(self, png: bytes, rgba: np.ndarray) -> np.ndarray:
        try:
            mask = mask_of_png(png)
        except ValueError as error:
            raise UsageError(f"the data sent is not an outline: {error}") from error
        if mask.shape != rgba.shape[:2]:
            raise UsageError(
                f"an outline of {mask.shape[1]} x {mask.shape[0]} pixels does not fit this photo; reload the page"
            )
        return mask


def _seen_again(photo: DoubtedPhoto, name: str, settings: MattingConfig) -> np.ndarray:
    """Return a photo ``(H, W, 4) uint8`` as ``shown_cutout`` would show it, cut out without more networks, empty if that fails.

    Raises UsageError where the photo cannot be read any more.
    """
    item, stage = photo.item, PhotoStage(settings)
    mask, box_px = masks_of(item)[photo.place or 0], as_box(item.box_px)
    try:
        rgba, _ = stage.cut_out(photo.file, name or None, lambda doubted: doubted.matte, mask=mask, box_px=box_px)
    except InputError as error:
        raise UsageError(f"{photo.file}: cannot be read: {error.detail}") from error
    except Rejected:
        pixels = _pixels(photo, name, settings)
        rgba = np.dstack([pixels[..., :3], np.zeros(pixels.shape[:2], np.uint8)])
    return reduced(rgba, SHOWN_PX)


def _pixels(photo: DoubtedPhoto, name: str | None, settings: MattingConfig) -> np.ndarray:
    """Return what is looked at of a photo of what a person calls ``name``: ``(H, W, 3 or 4) uint8``; raises UsageError."""
    mask, box_px = masks_of(photo.item)[photo.place or 0], as_box(photo.item.box_px)
    try:
        return pixels_of_photo(photo.file, name or None, settings, mask=mask, box_px=box_px).given.pixels
    except InputError as error:
        raise UsageError(f"{photo.file}: cannot be read: {error.detail}") from error


def _png(mask: np.ndarray) -> bytes:
    encoded = io.BytesIO()
    Image.fromarray(np.where(mask, 255, 0).astype(np.uint8)).save(encoded, "PNG")
    return encoded.getvalue()
