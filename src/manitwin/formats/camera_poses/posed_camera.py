"""Camera of a file of poses: position, rotation and lens."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from manitwin.errors import InputError

MOST_CAMERAS = 100_000
LARGEST_NUMBER = 1e9
"""Limit of lengths, focal lengths and picture coordinates; photos of an object have smaller ones."""
MOST_COEFFICIENT = 100.0
"""Limit of distortion coefficients; those of real lenses are below 10."""
_ROUNDED = 0.01  # tolerance for rounded rotations: deviation of axes from unit length and right angles


@dataclass(frozen=True)
class Lens:
    """A lens, for a picture of ``size_px`` (width, height); a size or centre of None is that of the photo.

    ``focal`` and ``centre_px`` are along x and y, in pixels whose centres are at one half; with ``in_widths``, the focal length
    is in widths of the picture. ``distortion`` are OpenCV's coefficients (k1, k2, p1, p2, k3, k4, k5, k6), with ``fisheye``
    those of its fisheye model (k1, k2, k3, k4); empty without distortion.
    """

    focal: tuple[float, float]
    centre_px: tuple[float, float] | None = None
    size_px: tuple[float, float] | None = None
    in_widths: bool = False
    distortion: tuple[float, ...] = ()
    fisheye: bool = False

    def with_picture_size(self, width: int, height: int) -> Lens:
        """Return the lens with unset values filled in from the photo's uncropped size."""
        size = self.size_px or (float(width), float(height))
        factor = size[0] if self.in_widths else 1.0
        return replace(
            self,
            focal=(self.focal[0] * factor, self.focal[1] * factor),
            centre_px=self.centre_px or (size[0] / 2, size[1] / 2),
            size_px=size,
            in_widths=False,
        )


@dataclass(frozen=True)
class PosedCamera:
    """A camera that took the picture ``file`` (its name in the file of poses).

    ``world_to_camera (3, 4)`` maps world points to the camera's frame: x right, y down, z forward. If the world was rotated
    after reading, ``as_read (3, 4)`` is the transform from the file's own world. ``mask`` is the path of the object mask that
    the file names.
    """

    file: str
    world_to_camera: np.ndarray
    lens: Lens
    as_read: np.ndarray | None = None
    mask: Path | None = None


def turned_upright(camera: PosedCamera, orientation: int) -> PosedCamera:
    """Convert the camera of a stored picture to that of the picture rotated upright by EXIF ``orientation`` 6 or 8.

    Its lens must state size and centre of the picture. Orientation 6 rotates the stored picture clockwise by a right angle, 8
    counter-clockwise.
    """
    lens, clockwise = camera.lens, orientation == 6
    (width, height), (middle_x, middle_y) = lens.size_px or (0.0, 0.0), lens.centre_px or (0.0, 0.0)
    turn = np.array([[0, -1.0, 0], [1.0, 0, 0], [0, 0, 1.0]])
    turn = turn if clockwise else turn.T
    bent = list(lens.distortion)
    if not lens.fisheye and len(bent) > 3:  # tangential coefficients rotate too
        bent[2:4] = [bent[3], -bent[2]] if clockwise else [-bent[3], bent[2]]
    upright = replace(
        lens,
        focal=lens.focal[::-1],
        centre_px=(height - middle_y, middle_x) if clockwise else (middle_y, width - middle_x),
        size_px=(height, width),
        distortion=tuple(bent),
    )
    return replace(camera, world_to_camera=turn @ camera.world_to_camera, lens=upright)


def orthonormalized(matrix: np.ndarray, told: str) -> np.ndarray:
    """Return a transform ``(3, 4)`` with its rotation orthonormalized.

    Raises InputError, with ``told`` before the cause, for invalid or too large numbers, axes that are not orthonormal, and
    reflections.
    """
    if not np.isfinite(matrix).all() or np.abs(matrix).max() > LARGEST_NUMBER:
        raise InputError("unreadable", f"{told}: a number is not finite or above {LARGEST_NUMBER:g}; correct the file")
    turn = matrix[:, :3]
    lengths = np.linalg.norm(turn, axis=0)
    if np.abs(turn.T @ turn - np.eye(3)).max() > 2 * _ROUNDED:
        shown = ", ".join(f"{length:.3g}" for length in lengths)
        raise InputError(
            "unreadable",
            f"{told}: not a rotation: its axes have the lengths {shown} or are not at right angles; write the"
            f" matrix without scale"
            " and shear",
        )
    if np.linalg.det(turn) < 0:
        raise InputError("unreadable", f"{told}: mirrors the world (left-handed axes); write right-handed axes")
    left, _, right = np.linalg.svd(turn)
    return np.column_stack([left @ right, matrix[:, 3]])


def checked_lens(lens: Lens, told: str) -> Lens:
    """Return the lens if its values are valid; raises InputError with ``told`` before the cause."""
    numbers = [*lens.focal, *(lens.centre_px or ()), *(lens.size_px or ())]
    if not all(math.isfinite(each) and abs(each) <= LARGEST_NUMBER for each in numbers):
        raise InputError(
            "unreadable", f"{told}: a lens parameter is not finite or above {LARGEST_NUMBER:g}; correct the file"
        )
    if min(*lens.focal, *(lens.size_px or (1.0,))) <= 0:
        raise InputError("unreadable", f"{told}: a focal length or picture size is not above 0; give pixels")
    if not all(math.isfinite(each) and abs(each) <= MOST_COEFFICIENT for each in lens.distortion):
        raise InputError(
            "unreadable",
            f"{told}: a distortion coefficient is not finite or above {MOST_COEFFICIENT:g}; correct the file",
        )
    return lens
