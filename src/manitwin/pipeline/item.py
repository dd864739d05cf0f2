"""One input of the pipeline as given by the user: the payload of the tasks that make twins."""

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
from manitwin.pipeline.photo_cameras import masks_in_pose_file, poses_identity, read_poses
from manitwin.twin.import_record import IMPORTED_MESH
from manitwin.twin.store import sha256_of_json

ID_DIGITS = 16
"""64 bits: the probability that two of 100,000 twins share an id is 3e-10."""


_END_BYTES = 1 << 20


@dataclass(frozen=True)
class Item(Payload):
    """One input as given by the user.

    - ``file``: absolute path, or None if ``text`` is given
    - ``units``, ``up``: as stated by the user ('auto': not stated)
    - ``longest_side_m``: the largest of length, width and height of the object as it stands; None if not stated
    - ``given``: the import.json of an imported mesh, with what the asset states
    - ``variation``: number of the object among those made from one text, each with a seed of its own
    - ``views``: absolute paths of further photos of the object in the photo ``file``
    - ``turns_deg``: the camera's rotation about the vertical in each photo, counter-clockwise seen from above, the first 0;
      empty if not stated
    - ``poses``: absolute path of a file, or of a COLMAP model folder, with the camera poses
    - ``photos_given``: original number of photos if they were thinned out; None otherwise
    - ``masks``: absolute paths of mask images, one per photo, '' for a photo without; empty if there are none
    - ``box_px``: bounding box of the object in a single photo: left, top, right, bottom
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
        """All given files: the mesh, or the photos in order; empty for a text."""
        return () if self.file is None else (self.file, *self.views)

    @property
    def title(self) -> str:
        """The file name with the number of further photos, or the beginning of the text with the variation's number.

        The box is included for a photo, as it may contain several inputs. Imported assets are called by their folder, because
        their meshes all have the same name.
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
        """When the files were last changed (st_ctime, which cannot be set by users); None if there are none, or one is
        missing.
        """
        try:
            beside = () if self.poses is None else (self.poses, *_named_masks(Path(self.poses)))
            beside = (*beside, *filter(None, self.masks))
            return max((os.stat(file).st_ctime for file in (*self.files, *beside)), default=None)
        except (OSError, ValueError):
            return None

    def to_json(self) -> dict[str, Any]:
        """Return the fields as stored in the ledger; fields added later are omitted at their defaults, to keep old rows equal."""
        fields = super().to_json()
        later = {"given": self.given is None, "variation": not self.variation}
        later |= {"views": not self.views, "turns_deg": not self.turns_deg}
        later |= {"longest_side_m": self.longest_side_m is None, "poses": self.poses is None}
        later |= {"photos_given": self.photos_given is None, "masks": not self.masks, "box_px": not self.box_px}
        kept = {name: value for name, value in fields.items() if not later.get(name, False)}
        return {name: list(value) if isinstance(value, tuple) else value for name, value in kept.items()}

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the item from a ledger of this version or an earlier one."""
        told: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()
        }
        return cls(**told)


def twin_id(item: Item) -> str:
    """Return the id of an item's twin: a hash of the input's content, name, size, units and up axis only.

    For several photos it covers all of them in order, with the stated turns, or poses and masks; for a single photo its mask
    and box. An imported asset's import.json is part of the content. Another configuration gives another revision of the same
    twin. Raises InputError ``unreadable`` if a file is missing or is not a regular file.
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
    """Return the mask of each photo: the given one, else the one named in the file of poses, else None.

    Raises InputError like ``cameras_of_photos``.
    """
    files = [Path(file) for file in item.files]
    named = [None] * len(files) if item.poses is None else masks_in_pose_file(files, Path(item.poses))
    given = item.masks or ("",) * len(files)
    return [Path(own) if own else mask for own, mask in zip(given, named, strict=True)]


def _named_masks(poses: Path) -> list[str]:
    """Return the existing masks that a file of poses names; empty if it is unreadable."""
    try:
        cameras = read_poses(poses).cameras
    except InputError:
        return []
    return [str(camera.mask) for camera in cameras if camera.mask is not None and camera.mask.is_file()]


def require_readable_size(path: Path) -> None:
    """Raise InputError ``too_large`` for a file beyond the limit of all readers."""
    size = path.stat().st_size
    if size > MAX_KEPT_BYTES:
        said = f"{size} bytes exceed the limit of {MAX_KEPT_BYTES}"
        raise InputError(
            "too_large", f"{printable_line(path.name)}: {said}; simplify it, or reduce the size of its textures"
        )


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file; for a file beyond the size limit, that of its size, beginning and end."""
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
