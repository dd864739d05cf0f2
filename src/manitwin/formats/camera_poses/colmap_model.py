"""Reader of the cameras and images of a COLMAP model, text or binary (colmap.github.io/format.html); points are skipped."""

from __future__ import annotations

import math
import os
import re
import struct
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import BinaryIO

import numpy as np

from manitwin.errors import InputError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.camera_poses.posed_camera import MOST_CAMERAS, Lens, PosedCamera, checked_lens, orthonormalized
from manitwin.formats.printable import printable_line

CAMERAS, IMAGES = "cameras", "images"
_MAX_BYTES = 4 << 30
_LONGEST_LINE, _LONGEST_NAME = 1 << 26, 4096
_POINT_BYTES = 24  # x, y and the id of a point
_SHOWN = 80
MODELS = (
    ("SIMPLE_PINHOLE", 3), ("PINHOLE", 4), ("SIMPLE_RADIAL", 4), ("RADIAL", 5), ("OPENCV", 8), ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12), ("FOV", 5), ("SIMPLE_RADIAL_FISHEYE", 4), ("RADIAL_FISHEYE", 5), ("THIN_PRISM_FISHEYE", 12),
)  # fmt: skip
"""Names and numbers of parameters, by COLMAP's model ids (``src/colmap/sensor/models.h``)."""
NOT_READ = frozenset({"FOV", "THIN_PRISM_FISHEYE"})

_refused = partial(InputError, "unreadable")


def model_files(folder: Path) -> tuple[Path, Path] | None:
    """Return the cameras and images files of a model in a folder, text before binary; None if there are none."""
    for suffix in (".txt", ".bin"):
        files = folder / f"{CAMERAS}{suffix}", folder / f"{IMAGES}{suffix}"
        if all(file.is_file() for file in files):
            return files
    return None


def read_model(cameras: Path, images: Path) -> list[PosedCamera]:
    """Return the cameras of a model's images, sorted by name; raises InputError with one line."""
    binary = images.suffix == ".bin"
    try:
        with open_regular(cameras, _refused) as stream:
            lenses = dict((_binary_lenses if binary else _text_lenses)(_bounded(stream, cameras)))
        with open_regular(images, _refused) as stream:
            found = list((_binary_images if binary else _text_images)(_bounded(stream, images)))
    except (struct.error, ValueError, EOFError, OverflowError) as error:
        cause = printable_line(str(error), max_characters=_SHOWN)
        raise _refused(f"{cameras.parent.name}: not a COLMAP model, or truncated ({cause}); export it again") from error
    if not found:
        raise _refused(f"{images.name}: has no images; export the model again")
    posed = []
    for quaternion, place, camera, name in found:
        told = f"{images.name}: {printable_line(name, max_characters=_SHOWN)}"
        if camera not in lenses:
            raise _refused(f"{told}: its camera {camera} is not in {cameras.name}; export the model again")
        pose = np.column_stack([_rotation(quaternion, told), place])
        posed.append(PosedCamera(name, orthonormalized(pose, told), checked_lens(lenses[camera], told)))
    return sorted(posed, key=lambda each: each.file)


def _bounded(stream: BinaryIO, path: Path) -> BinaryIO:
    size = os.fstat(stream.fileno()).st_size
    if size > _MAX_BYTES:
        raise _refused(f"{path.name}: {size} bytes exceed the limit of {_MAX_BYTES}; leave out its points")
    return stream


def _rotation(quaternion: tuple[float, ...], told: str) -> np.ndarray:
    length = math.sqrt(sum(each * each for each in quaternion))
    if not abs(length - 1) < 0.01:
        raise _refused(
            f"{told}: its quaternion has the length {length:.3g}, but a rotation has length 1; correct the file"
        )
    w, x, y, z = (each / length for each in quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _lens(model: str, size_px: tuple[float, float], values: tuple[float, ...]) -> Lens:
    count = dict(MODELS).get(model)
    if count is None or model in NOT_READ:
        raise _refused(
            f"the camera model {printable_line(model, max_characters=_SHOWN)} is not read; undistort the photos"
        )
    if len(values) != count:
        raise _refused(f"a camera {model} has {len(values)} parameters, but needs {count}; export the model again")
    one = model.startswith(("SIMPLE", "RADIAL"))
    focal = (values[0], values[0]) if one else (values[0], values[1])
    at = 1 if one else 2
    bent = values[at + 2 :]
    fisheye = model.endswith("FISHEYE")
    # OpenCV's order is two radial, two tangential, then the other radial coefficients; its fisheye model has four radial ones
    distortion = (*bent, *([0.0] * (4 - len(bent)))) if bent else ()
    return Lens(focal, (values[at], values[at + 1]), size_px, distortion=distortion, fisheye=fisheye)


def _text_lenses(stream: BinaryIO) -> Iterator[tuple[int, Lens]]:
    for line in _lines(stream):
        words = line.split()
        if words and len(words) < 5:
            raise ValueError("a line of a camera has fewer than 5 words")
        if words:
            size = float(words[2]), float(words[3])
            yield int(words[0]), _lens(words[1], size, tuple(map(float, words[4:])))


_POINT_ID = re.compile(r"-?[0-9]+")
_Image = tuple[tuple[float, ...], tuple[float, ...], int, str]
"""Quaternion wxyz, translation, camera id, name."""


def _text_images(stream: BinaryIO) -> Iterator[_Image]:
    """Yield images; the line of each is followed by a line of its points, which some programs omit."""
    points_expected, count = False, 0
    for line in _lines(stream):
        words = line.split(maxsplit=9)
        is_image = len(words) == 10 and not _POINT_ID.fullmatch(words[9].split()[-1])  # a name rather than a point's id
        if points_expected and not is_image:
            points_expected = False
            continue
        if not words:
            continue
        if not is_image and len(words) < 10:
            raise ValueError("a line of an image has fewer than 10 words")
        numbers = [float(word) for word in words[1:8]]
        count += 1
        if count > MOST_CAMERAS:
            raise ValueError(f"more than {MOST_CAMERAS} images")
        yield tuple(numbers[:4]), tuple(numbers[4:]), int(words[8]), words[9].strip()
        points_expected = True


def _lines(stream: BinaryIO) -> Iterator[str]:
    while line := stream.readline(_LONGEST_LINE):
        if not line.startswith(b"#"):
            yield line.decode("utf-8")


def _binary_lenses(stream: BinaryIO) -> Iterator[tuple[int, Lens]]:
    for _ in range(_count(stream)):
        number, model, width, height = _unpacked(stream, "<IiQQ")
        if not 0 <= model < len(MODELS):
            raise ValueError(f"a camera model {model}")
        name, count = MODELS[int(model)]
        yield int(number), _lens(name, (float(width), float(height)), _unpacked(stream, f"<{count}d"))


def _binary_images(stream: BinaryIO) -> Iterator[_Image]:
    end = os.fstat(stream.fileno()).st_size
    for _ in range(_count(stream)):
        values = _unpacked(stream, "<I7dI")
        name = bytearray()
        while (byte := stream.read(1)) != b"\0":
            if not byte or len(name) >= _LONGEST_NAME:
                raise ValueError("a name without an end")
            name += byte
        (points,) = _unpacked(stream, "<Q")
        if stream.tell() + _POINT_BYTES * int(points) > end:
            raise ValueError("more points than the file has bytes")
        stream.seek(_POINT_BYTES * int(points), os.SEEK_CUR)
        yield tuple(values[1:5]), tuple(values[5:8]), int(values[8]), name.decode("utf-8")


def _count(stream: BinaryIO) -> int:
    (count,) = _unpacked(stream, "<Q")
    if count > MOST_CAMERAS:
        raise ValueError(f"{count:.0f} cameras or images")
    return int(count)


def _unpacked(stream: BinaryIO, layout: str) -> tuple[float, ...]:
    content = stream.read(struct.calcsize(layout))
    return struct.unpack(layout, content)
