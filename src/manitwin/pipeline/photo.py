"""Photo input: reading, and cutting the object out of the background (paper, "3D Generation": background removal, resolution)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from PIL import Image

from manitwin.config import MattingConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.errors import InputError, Rejected
from manitwin.geometry.pixel_boxes import PixelBox
from manitwin.models.generators.templates.fitting.outline_check import template_outline_check
from manitwin.models.matting.candidates import network_makers
from manitwin.models.matting.learned import Network
from manitwin.models.matting.matte import DoubtfulMatte, Matte, matte_photo
from manitwin.models.matting.object_network import built_in_model
from manitwin.models.matting.outline_network import outline_model
from manitwin.pipeline.box_check import require_in_box
from manitwin.pipeline.cutout import confirmed_or_rejected
from manitwin.pipeline.drawn_outline import DrawnOutline, cut_by_outline, drawn_outline
from manitwin.pipeline.given_alpha import doubted_rectangle
from manitwin.pipeline.human_corrections import name_by_person
from manitwin.pipeline.item import Item, masks_of
from manitwin.pipeline.photo_groups import distinct_names, identical_file_messages
from manitwin.pipeline.photo_pixels import pixels_of_photo
from manitwin.pipeline.stated_place import as_box


class PhotoStage:
    """Cut out the object of a photo. Writes ``photo.png`` (RGBA, upright, alpha is the matte) and the field ``matte``."""

    name: ClassVar[str] = "photo"
    version: ClassVar[str] = "27"
    reads: ClassVar[tuple[str, ...]] = ()
    writes: ClassVar[tuple[str, ...]] = ("photo.png", "matte")
    needs: ClassVar[Resource] = "cpu"

    def __init__(self, settings: MattingConfig, networks: Sequence[Network] = ()):
        """Take the settings, and the matting networks that they name; networks enter the stage's key by content, not by path."""
        self.settings = settings.model_copy(update={"network": None})
        self.networks = tuple(networks)
        self.backend: str = "rules+network"
        models = (*(each.model for each in networks), built_in_model(), outline_model())
        self.model: str | None = ", ".join(models)

    def run(self, draft: Draft[Item], folder: Path) -> dict[str, Any]:
        """Read and matte the photo. Raises InputError, or Rejected if no single object can be separated from the background."""
        if draft.payload.file is None:
            raise InputError("empty", "no image was given; give an image file")
        amendment = draft.amendments.get(self.name, {})
        path = Path(draft.payload.file)
        rgba, field = self.cut_out(
            path,
            name_by_person(draft),
            lambda doubted: confirmed_or_rejected(doubted, path.name, amendment),
            mask=next(iter(masks_of(draft.payload))),
            box_px=as_box(draft.payload.box_px),
            drawn=drawn_outline(amendment, path.name),
        )
        _save(rgba, folder / "photo.png")
        return {"matte": field}

    def cut_out(
        self,
        path: Path,
        name: str | None,
        confirmed: Callable[[DoubtfulMatte], Matte],
        called: str | None = None,
        mask: Path | None = None,
        box_px: PixelBox | None = None,
        drawn: DrawnOutline | None = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Return a photo ``(H, W, 4) uint8`` with its matte, and the field ``matte``; ``name`` is the user's name of the object.

        ``called`` is the file's name in messages. ``confirmed`` returns the matte of a doubtful cut-out that is nevertheless
        right, or raises. ``mask`` is a mask image, ``box_px`` the object's bounding box in the photo: the result is then the
        photo around it. ``drawn`` is an outline drawn by a person, which takes precedence. Raises InputError, Rejected.
        """
        settings, file = self.settings, called or path.name
        photo = pixels_of_photo(path, name, settings, mask=mask, box_px=box_px)
        given = photo.given if drawn is None else cut_by_outline(photo.given, drawn, file)
        try:
            matte = matte_photo(
                given.pixels,
                file,
                working_side_px=settings.working_side_px,
                min_confidence=settings.min_confidence,
                min_area_share=settings.min_area_share,
                second_object_share=settings.second_object_share,
                networks=self.networks,
                explains=template_outline_check(name, photo.focal_mm),
                window_px=photo.window_px,
            )
            if given.is_doubted:
                raise doubted_rectangle(matte, file, name)
            if photo.box_px is not None and drawn is None:
                require_in_box(matte, photo.box_px, file)
        except DoubtfulMatte as doubted:
            matte = confirmed(doubted)
        return np.ascontiguousarray(matte.rgba), {
            "method": matte.method,
            "confidence": matte.confidence,
            "findings": [*photo.findings, *given.findings, *matte.findings],
            "scores": matte.scores,
            "agreement": matte.agreement,
            "focal_mm": photo.focal_mm,
            **self._networks_asked(matte),
        }

    def _networks_asked(self, matte: Matte) -> dict[str, Any]:
        """Return the record of the named networks if they were used; the built-in network is then recorded under its own name."""
        if "built_in_network" not in matte.agreement:
            return {}
        told = ("name", "sha256", "source", "licence")
        return {
            maker: {name: getattr(network, name) for name in told}
            for maker, network in zip(network_makers(len(self.networks) + 1), self.networks, strict=False)
        }


class PhotosStage(PhotoStage):
    """Cut out several photos of one object: ``photos/`` contains each by its number, ``photo.png`` is the first.

    Photos that cannot be cut out are left out, with a finding; the field ``matte`` is that of the least confident remaining
    photo.
    """

    version: ClassVar[str] = "19"
    writes: ClassVar[tuple[str, ...]] = ("photo.png", "photos/", "matte")

    def run(self, draft: Draft[Item], folder: Path) -> dict[str, Any]:
        """Read and matte the photos. Raises InputError for an unreadable photo, Rejected if none can be cut out."""
        (folder / "photos").mkdir()
        kept: list[tuple[str, dict[str, Any]]] = []
        doubts: list[Rejected] = []
        files, masks, name = draft.payload.files, masks_of(draft.payload), name_by_person(draft)
        amendment = draft.amendments.get(self.name, {})
        for number, (file, called, mask) in enumerate(zip(files, distinct_names(files), masks, strict=True)):
            try:
                drawn = drawn_outline(amendment, called, number)
                rgba, field = self.cut_out(Path(file), name, reject_doubted, called, mask, drawn=drawn)
            except InputError:  # not a photo: the input is not what was intended
                raise
            except Rejected as answer:
                doubts.append(answer)
                continue
            _save(rgba, folder / "photos" / f"{number:02d}.png")
            if not kept:
                _save(rgba, folder / "photo.png")
            kept.append((called, field))
        left_out = [f"left out: {answer.detail}" for answer in doubts]
        if not kept:
            raise Rejected(doubts[0].reason, "; ".join(answer.detail for answer in doubts), doubts[0].stage)
        if len(kept) == 1:
            left_out.append(f"{kept[0][0]} is the only photo that could be cut out: the rest is a guess")
        findings = [f"{called}: {finding}" for called, field in kept for finding in field["findings"]]
        worst = min((field for _, field in kept), key=lambda field: field["confidence"])
        matte = worst | {
            "findings": [*identical_file_messages(draft.payload.files), *left_out, *findings],
            "photos": [field["confidence"] for _, field in kept],
        }
        matte["focals_mm"] = [field["focal_mm"] for _, field in kept]
        for _, field in kept:
            matte |= {maker: field[maker] for maker in network_makers(len(self.networks) + 1) if maker in field}
        return {"matte": matte}


def reject_doubted(doubted: DoubtfulMatte) -> Matte:
    """Raise the doubt about a cut-out that no reviewer can confirm."""
    raise doubted


def _save(rgba: np.ndarray, path: Path) -> None:
    Image.fromarray(rgba).save(path, compress_level=3)
