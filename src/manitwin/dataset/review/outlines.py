"""``manitwin review cutouts --draw``: draw object outlines where the matte is doubted, and state names and sizes."""

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
from manitwin.dataset.review.item_rebuild import rebuild_items
from manitwin.dataset.review.object_statements import (
    ObjectStatement,
    current_statement,
    read_name,
    read_side_cm,
    with_statement,
)
from manitwin.engine.amendments import Amendments, read_amendments, write_amendments
from manitwin.engine.drive import RunOptions, RunReport
from manitwin.errors import InputError, Rejected, UsageError
from manitwin.models.matting.fitted_outline import fit_outline
from manitwin.models.matting.matte import matte_photo
from manitwin.pipeline.cutout import CONFIRMED, CUTOUT, QUALITY, SHOWN_PX, reduced
from manitwin.pipeline.drawn_outline import (
    DrawnOutline,
    cut_by_outline,
    drawn_outline,
    mask_of_png,
    why_no_outline,
    with_outline,
)
from manitwin.pipeline.given_alpha import CutOutInput
from manitwin.pipeline.human_corrections import HUMAN
from manitwin.pipeline.item import masks_of
from manitwin.pipeline.photo import PhotoStage
from manitwin.pipeline.photo_pixels import pixels_of_photo
from manitwin.pipeline.settings import stored_config
from manitwin.pipeline.stated_place import as_box
from manitwin.twin.dataset_root import DatasetRoot


class OutlineSession:
    """The photos of ``photos_to_draw``, their pictures, and the outlines and statements of ``annotator``.

    Outlines and statements are stored immediately in the data set's amendments; ``build`` builds the twins. Photos are identified
    by their ``key``. Raises UsageError as ``photos_to_draw`` does.
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
    def outlined_keys(self) -> tuple[str, ...]:
        """Keys of the photos whose outlines were stored, in order."""
        return tuple(self._kept)

    @property
    def restated_twins(self) -> tuple[str, ...]:
        """Ids of the twins whose name or size was changed, in order."""
        return tuple(self._said)

    def photo(self, key: str) -> DoubtedPhoto:
        """Return the photo with a key; raises UsageError if there is none."""
        if key not in self.photos:
            raise UsageError(f"{key}: not a photo with a doubtful cut-out; reload the list")
        return self.photos[key]

    def words(self, key: str) -> ObjectStatement:
        """Return the current name and size statements on the photo's object."""
        photo = self.photo(key)
        return current_statement(photo.item, read_amendments(self.root, photo.twin_id))

    def picture(self, key: str) -> bytes:
        """Return the displayed picture of a photo as a WebP file."""
        encoded = io.BytesIO()
        Image.fromarray(self._rgba(key)[..., :3]).save(encoded, "WEBP", quality=QUALITY, method=4)
        return encoded.getvalue()

    def mask(self, key: str) -> bytes:
        """Return the current mask as a PNG file of the picture's size, white on the object: the drawn outline, else the doubted
        matte.
        """
        photo, rgba = self.photo(key), self._rgba(key)
        drawn = drawn_outline(read_amendments(self.root, photo.twin_id).get(PhotoStage.name, {}), key, photo.place)
        same = drawn is not None and drawn.mask.shape == rgba.shape[:2]
        return _png(drawn.mask if drawn is not None and same else rgba[..., 3] > 127)

    def snap_mask(self, key: str, png: bytes) -> bytes:
        """Return an outline mask (PNG) snapped to nearby image edges, as PNG; raises UsageError for an invalid mask."""
        rgba = self._rgba(key)
        with self._lock:  # OpenCV's random number generator is shared by the process
            return _png(fit_outline(rgba[..., :3], self._mask(png, rgba)))

    def store_outline(self, key: str, png: bytes | None, name: object = None, longest_side_cm: object = None) -> None:
        """Store an outline mask (PNG), a name and a longest side (cm) for all later builds; None leaves a value unchanged.

        Raises UsageError, and stores nothing, if the outline does not segment a single object, if the name or length is invalid,
        or if the name changes which part of the picture is used.
        """
        photo, source = self.photo(key), f"{HUMAN}{self.annotator}"
        drawn = None if png is None else self._drawn(key, png, source)
        with self._writing:
            before = read_amendments(self.root, photo.twin_id)
            now = current_statement(photo.item, before)
            words = ObjectStatement(
                now.name if name is None else read_name(name),
                now.longest_side_cm if longest_side_cm is None else read_side_cm(longest_side_cm, self._gate),
            )
            after = with_statement(before, photo.item, words, source)
            if drawn is not None:
                said = {key: each for key, each in after.get(PhotoStage.name, {}).items() if key != CONFIRMED}
                after[PhotoStage.name] = with_outline(said, drawn, photo.place)
            if {words.name, now.name} != {photo.item.name or ""}:
                is_renamed = words.name != now.name and photo.place is not None
                for place in range(len(photo.item.files)) if is_renamed else (photo.place,):
                    self._require_same_picture(replace(photo, place=place), words.name, after)
            if after != before:
                write_amendments(self.root, photo.twin_id, after)
            if current_statement(photo.item, after) != now:
                self._said[photo.twin_id] = None
            if drawn is not None:
                self._kept[key] = None

    def build(self, *, jobs: int | None = None, **options: Unpack[RunOptions]) -> RunReport:
        """Build the twins with new outlines or statements; raises UsageError if another run is active on the data set."""
        by_twin = {photo.twin_id: photo for photo in self.photos.values()}
        changed = dict.fromkeys((*(self.photos[key].twin_id for key in self._kept), *self._said))
        chosen = [by_twin[twin_id] for twin_id in changed]
        return rebuild_items(self.root, ((each.number, each.item) for each in chosen), jobs, **options)

    def _drawn(self, key: str, png: bytes, source: str) -> DrawnOutline:
        rgba = self._rgba(key)
        drawn = DrawnOutline(self._mask(png, rgba), source)
        if (why := why_no_outline(drawn.mask)) is not None:
            raise UsageError(f"not kept: the outline {why}; draw it around the object")
        try:
            matte_photo(
                cut_by_outline(CutOutInput(rgba[..., :3]), drawn, "this photo").pixels,
                "this photo",
                min_area_share=self._settings.min_area_share,
                second_object_share=self._settings.second_object_share,
            )
        except Rejected as error:
            raise UsageError(f"not kept: {error.detail}") from error
        return drawn

    def _require_same_picture(self, photo: DoubtedPhoto, name: str, amendments: Amendments) -> None:
        """Raise UsageError if an outline refers to another part of the picture than is used under a name."""
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
                    self._looked_at[key] = _segment_again(photo, self.words(key).name, self._settings)
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


def _segment_again(photo: DoubtedPhoto, name: str, settings: MattingConfig) -> np.ndarray:
    """Return a photo ``(H, W, 4) uint8`` as ``encode_preview`` would: segmented without further networks, with zero alpha on
    failure.

    Raises UsageError if the photo can no longer be read.
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
    """Return the used part ``(H, W, 3 or 4) uint8`` of a photo of an object named ``name``; raises UsageError."""
    mask, box_px = masks_of(photo.item)[photo.place or 0], as_box(photo.item.box_px)
    try:
        return pixels_of_photo(photo.file, name or None, settings, mask=mask, box_px=box_px).given.pixels
    except InputError as error:
        raise UsageError(f"{photo.file}: cannot be read: {error.detail}") from error


def _png(mask: np.ndarray) -> bytes:
    encoded = io.BytesIO()
    Image.fromarray(np.where(mask, 255, 0).astype(np.uint8)).save(encoded, "PNG")
    return encoded.getvalue()
