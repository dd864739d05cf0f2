"""One input of the pipeline as the user gave it: the payload of the tasks that make twins."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from io import BufferedReader
from pathlib import Path
from typing import Any, Literal, Self, cast

from manitwin.engine.task import Payload
from manitwin.errors import InputError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.packed_source import MAX_KEPT_BYTES
from manitwin.formats.printable import printable_line
from manitwin.formats.source_files import side_files
from manitwin.geometry.length_unit import StatedUnit
from manitwin.pipeline.photo_cameras import masks_of_photos, poses_identity, read_poses
from manitwin.twin.import_record import IMPORTED_MESH
from manitwin.twin.store import sha256_of_json

ID_DIGITS = 16
"""64 bits: among 100,000 twins two share an id with a probability of 3e-10."""


_END_BYTES = 1 << 20


@dataclass(frozen=True)
class Item(Payload):
    """One input as the user gave it.

    ``file`` is an absolute path, or None where ``text`` is given. ``units`` and ``up`` are what the user said ('auto': unsaid).
    ``longest_side_m`` is the longest of its length, width and height as it stands, None where the user does not say it.
    ``given`` is the import.json beside an imported mesh: what another tool says of it. ``variation`` counts the things that are
    made of one text: each is drawn from a seed of its own. ``views`` are the absolute paths of further photos of the thing that
    the photo ``file`` shows; ``turns_deg`` is the camera's turn about the vertical in each photo, counter-clockwise seen from
    above, that of the first 0; empty where nobody states them. ``poses`` is the absolute path of a file, or of the folder of a
    COLMAP model, that states the cameras of the photos. ``photos_given`` is how many photos there were where they were thinned
    out; None where all are here. ``masks`` are the absolute paths of pictures of the thing's outline, one a photo, '' where a
    photo has none; empty where nobody gives one. ``box_px`` is where the thing is in the one photo: left, top, right, bottom.
    """

    file: str | None
    text: str | None = None
    name: str | None = None
    units: StatedUnit = "auto"
    up: Literal["y", "z", "auto"] = "auto"
    license: str | None = None
    attribution: str | None = None
    given: str | None = None
    variation: int = 0
    views: tuple[str, ...] = ()
    turns_deg: tuple[float, ...] = ()
    longest_side_m: float | None = None
    poses: str | None = None
    photos_given: int | None = None
    masks: tuple[str, ...] = ()
    box_px: tuple[float, ...] = ()

    @property
    def files(self) -> tuple[str, ...]:
        """All files that were given: the mesh, or the photos in order; none of a text."""
        return () if self.file is None else (self.file, *self.views)

    @property
    def title(self) -> str:
        """The name of the file and the number of further photos, or the begin of the text, with the number of a variation.

        Of a photo with a box that too: others of its things may be inputs.

        The mesh of every imported asset has the same name: it is told by its folder.
        """
        if self.file:
            path = Path(self.file)
            if self.given is not None and path.name == IMPORTED_MESH:
                return path.parent.name or path.name
            more = f" and {len(self.views)} more" if self.views else ""
            more += f" (box {','.join(f'{edge:g}' for edge in self.box_px)})" if self.box_px else ""
            return f"{path.name}{more}"
        number = f" ({self.variation + 1})" if self.variation else ""
        return f"'{(self.text or '')[:40]}'{number}"

    @property
    def modified_at(self) -> float | None:
        """When its files were last changed (st_ctime, which nobody sets), None where it has none now."""
        try:
            beside = () if self.poses is None else (self.poses, *_named_masks(Path(self.poses)))
            beside = (*beside, *filter(None, self.masks))
            return max((os.stat(file).st_ctime for file in (*self.files, *beside)), default=None)
        except (OSError, ValueError):
            return None

    def to_json(self) -> dict[str, Any]:
        """Return the fields as a ledger keeps them; of those that came later, only what is said: old rows stay equal."""
        fields = super().to_json()
        later = {"given": self.given is None, "variation": not self.variation}
        later |= {"views": not self.views, "turns_deg": not self.turns_deg}
        later |= {"longest_side_m": self.longest_side_m is None, "poses": self.poses is None}
        later |= {"photos_given": self.photos_given is None, "masks": not self.masks, "box_px": not self.box_px}
        kept = {name: value for name, value in fields.items() if not later.get(name, False)}
        return {name: list(value) if isinstance(value, tuple) else value for name, value in kept.items()}

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the item that a ledger of this version or an earlier one keeps."""
        told: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()
        }
        return cls(**told)


def twin_id(item: Item) -> str:
    """Return the id of the twin that an item makes: a hash of the input's bytes, name, size, units and up axis, of nothing else.

    Of several photos of one thing it covers all, in their order, and the stated turns, or poses and masks; of one its mask and
    box. What another tool says of an imported mesh is part of the input. Another configuration is another revision of the same
    twin. Raises InputError ``unreadable`` where a file has gone since the input was listed, or is no regular one now.
    """
    if item.file is None:
        content: dict[str, object] = {"text": item.text}
    elif item.views:
        photos = [{"suffix": Path(file).suffix.lower(), "sha256": file_sha256(Path(file))} for file in item.files]
        content = {"photos": photos, "turns_deg": list(item.turns_deg)}
        if item.photos_given is not None:
            content |= {"photos_given": item.photos_given}
        if item.poses is not None:
            content |= {"poses": poses_identity([Path(file) for file in item.files], Path(item.poses))}
        masks = masks_of(item)
        if any(masks):
            content |= {"masks": [None if mask is None else file_sha256(mask) for mask in masks]}
    else:
        path = Path(item.file)
        digest, root = file_sha256(path), path.parent.resolve()
        sides = {p.relative_to(root).as_posix(): file_sha256(p) for p in side_files(path)}
        content = {"suffix": path.suffix.lower(), "sha256": digest, "side_files": sides}
        if item.masks:
            content["mask"] = file_sha256(Path(item.masks[0]))
        if item.box_px:
            content["box_px"] = list(item.box_px)
    if item.given is not None:
        content = {"mesh": content, "given": file_sha256(Path(item.given))}
    if item.variation:
        content = {"content": content, "variation": item.variation}
    identity: dict[str, object] = {"content": content, "name": item.name, "units": item.units, "up": item.up}
    if item.longest_side_m is not None:
        identity["longest_side_m"] = item.longest_side_m
    return sha256_of_json(identity)[:ID_DIGITS]


def masks_of(item: Item) -> list[Path | None]:
    """Return the mask of each photo: the one that is given of it, else the one that the file of poses names, else None.

    Raises InputError as ``cameras_of_photos`` does.
    """
    files = [Path(file) for file in item.files]
    named = [None] * len(files) if item.poses is None else masks_of_photos(files, Path(item.poses))
    given = item.masks or ("",) * len(files)
    return [Path(own) if own else mask for own, mask in zip(given, named, strict=True)]


def _named_masks(poses: Path) -> list[str]:
    """Return the masks that a file of poses names and that are there; none where it is not read."""
    try:
        cameras = read_poses(poses).cameras
    except InputError:
        return []
    return [str(camera.mask) for camera in cameras if camera.mask is not None and camera.mask.is_file()]


def require_readable_size(path: Path) -> None:
    """Raise InputError ``too_large`` for a file that no reader takes."""
    size = path.stat().st_size
    if size > MAX_KEPT_BYTES:
        said = f"{size} bytes exceed the limit of {MAX_KEPT_BYTES}"
        raise InputError(
            "too_large", f"{printable_line(path.name)}: {said}; simplify it, or reduce the size of its textures"
        )


def file_sha256(path: Path) -> str:
    """Return the sha256 of a file; of one that no reader takes, that of its size, beginning and end."""
    try:
        with open_regular(path, partial(InputError, "unreadable")) as stream:
            size = os.fstat(stream.fileno()).st_size
            if size <= MAX_KEPT_BYTES:
                return hashlib.file_digest(cast(BufferedReader, stream), "sha256").hexdigest()
            content = stream.read(_END_BYTES)
            stream.seek(-_END_BYTES, os.SEEK_END)
            content += stream.read(_END_BYTES)
            return hashlib.sha256(b"%d bytes\n" % size + content).hexdigest()
    except OSError as error:
        raise InputError(
            "unreadable", f"{printable_line(path.name)}: {error.strerror or error}; copy it again"
        ) from error
