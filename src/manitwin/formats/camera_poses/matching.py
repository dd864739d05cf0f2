"""Matching of photos with the cameras of a file, by name, and by trailing folders where names are the same."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from manitwin.errors import InputError
from manitwin.formats.camera_poses.posed_camera import PosedCamera
from manitwin.formats.printable import printable_line

_SHOWN = 3


def cameras_of(photos: Sequence[Path], cameras: Sequence[PosedCamera], called: str) -> list[PosedCamera | None]:
    """Return the camera of each photo, None if the file named ``called`` has none.

    Only names are compared; no file is opened. A name in the file may lack its suffix, or have that of another format. Raises
    InputError if a photo matches several cameras, or two photos match one.
    """
    parts = [_parts(camera.file) for camera in cameras]
    by_stem: dict[str, list[int]] = {}
    for number, own in enumerate(parts):
        if own:
            for stem in {own[-1], _stem(own[-1])}:
                by_stem.setdefault(stem, []).append(number)
    found = [_camera_of(photo, parts, by_stem, called) for photo in photos]
    for number, taken in enumerate(found):
        if taken is not None and taken in found[:number]:
            both = f"{_shown_path(photos[found.index(taken)])} and {_shown_path(photos[number])}"
            raise InputError(
                "unreadable",
                f"{both}: both match the same pose of {called}, {_shown_path(Path(cameras[taken].file))}; give only one"
                f" of them",
            )
    return [None if number is None else cameras[number] for number in found]


def _camera_of(photo: Path, parts: Sequence[tuple[str, ...]], by_stem: dict[str, list[int]], called: str) -> int | None:
    own = photo.parts
    # among photos that differ only in the suffix, the one with the photo's own suffix
    for key in (own[-1], _stem(own[-1])):
        likely = by_stem.get(key, [])
        if not likely:
            continue
        lengths = [_common_suffix_length(own[:-1], parts[number][:-1]) for number in likely]
        best = [number for number, length in zip(likely, lengths, strict=True) if length == max(lengths)]
        if len(best) > 1:
            names = ", ".join("/".join(parts[number][-3:]) for number in best[:_SHOWN])
            shown = printable_line(names, max_characters=200)
            raise InputError(
                "unreadable",
                f"{_shown_path(photo)}: matches several entries of {called}: {shown}; keep the photos in the folders that"
                f" the file names",
            )
        return best[0]
    return None


def _parts(file: str) -> tuple[str, ...]:
    return tuple(part for part in PurePosixPath(file.strip().replace("\\", "/")).parts if part not in ("/", ".", ".."))


def _stem(name: str) -> str:
    return PurePosixPath(name).stem


def _common_suffix_length(one: Sequence[str], other: Sequence[str]) -> int:
    """Return the number of trailing folders in which two paths agree."""
    same = 0
    for first, second in zip(reversed(one), reversed(other), strict=False):
        if first != second:
            break
        same += 1
    return same


def _shown_path(path: Path) -> str:
    return printable_line("/".join(path.parts[-2:]), max_characters=120)
