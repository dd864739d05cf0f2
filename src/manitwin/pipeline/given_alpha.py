"""Interpretation of an image's own alpha channel: a cut-out, a faint cut-out, or an opaque image with transparent bars."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from manitwin.formats.image_file import MIN_SIDE_PX
from manitwin.formats.outline_mask import read_mask
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.matting.matte import TRANSPARENT_SHARE, DoubtfulMatte, Matte
from manitwin.pipeline.drawn_border import BORDERED, without_border

OPAQUE = 250
"""Alpha from which a pixel counts as opaque; lossy compression deviates by a few levels."""
LEAST_DRAWN = 26
"""A tenth of opaque; a channel that does not reach it is empty."""
MOST_OF_CORNERS = 1 / 500
"""Share of an upright rectangle that rounded corners, such as those of a window on a screen, may leave transparent."""
DOUBTFUL = 0.5
"""Probability that a rectangle is the intended object, if its name is unknown."""
RECTANGULAR_SHAPES = frozenset({"flat and rectangular", "flat board", "box-shaped", "block-shaped"})
FRAMED = "its alpha channel frames an upright rectangle, a picture with transparent bars: cropped to it"


@dataclass(frozen=True)
class CutOutInput:
    """The image to be cut out: ``pixels (H, W, 3 or 4) uint8``, findings, and whether its alpha channel is doubtful."""

    pixels: np.ndarray
    findings: tuple[str, ...] = ()
    is_doubted: bool = False


def interpret_alpha(pixels: np.ndarray, name: str | None) -> CutOutInput:
    """Interpret an image ``(H, W, 3 or 4) uint8`` of an object that the user calls ``name``.

    If the opaque region is an upright rectangle with bars around it, the name decides whether that is the object (a book, a
    box) or an image of it, which is then cropped to. It is doubtful without a known name. A border drawn around a photo is cut
    off (``drawn_border``).
    """
    pixels, findings = normalize_alpha(pixels)
    rectangular = is_rectangular(name)
    if pixels.shape[2] == 3 or pixels[..., 3].min() == 255:
        inside = without_border(np.ascontiguousarray(pixels[..., :3]), rectangular)
        return CutOutInput(pixels, findings) if inside is None else CutOutInput(inside, (*findings, BORDERED))
    framed = framed_picture(pixels)
    if framed is None:
        return CutOutInput(pixels, findings)
    if rectangular is False:
        return CutOutInput(framed, (*findings, FRAMED))
    return CutOutInput(pixels, findings, is_doubted=rectangular is None)


def apply_mask(pixels: np.ndarray, mask: Path, orientation: int) -> CutOutInput:
    """Return an image ``(H, W, 3 or 4) uint8`` cut out by the mask file, combined with its own alpha channel.

    ``orientation`` is the photo's EXIF orientation. Raises InputError like ``read_mask``.
    """
    pixels, findings = normalize_alpha(pixels)
    alpha = read_mask(mask, pixels.shape[:2], orientation)
    if pixels.shape[2] == 4:
        alpha = np.minimum(alpha, pixels[..., 3])
    return CutOutInput(np.dstack([pixels[..., :3], alpha]), (*findings, f"cut out as its mask says, {mask.name}"))


def normalize_alpha(pixels: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return an image ``(H, W, 3 or 4) uint8`` with a usable alpha channel or without one, and findings.

    A constant channel is dropped. A channel that is opaque nowhere belongs to a faint cut-out (e.g. a glass drawn translucent):
    it is stretched so that its highest value is opaque.
    """
    if pixels.shape[2] != 4:
        return pixels, ()
    least, most = int(pixels[..., 3].min()), int(pixels[..., 3].max())
    if most < LEAST_DRAWN or most == least == 255:
        return pixels, ()
    if least == most:
        return np.ascontiguousarray(pixels[..., :3]), (f"its alpha channel is {most} of 255 everywhere: not used",)
    if most >= OPAQUE:
        return pixels, ()
    stretched = pixels.copy()
    stretched[..., 3] = np.rint(pixels[..., 3] * (255 / most))
    return stretched, (f"its alpha channel reaches {most} of 255: what is most opaque was taken for the thing",)


def framed_picture(pixels: np.ndarray) -> np.ndarray | None:
    """Return the image ``(H, W, 3) uint8`` inside, if the opaque region of ``pixels`` is an upright rectangle with bars; else
    None.

    Rounded corners as small as a window's are tolerated, and pixels outside that are not opaque, such as a window's shadow.
    """
    if pixels.shape[2] != 4:
        return None
    opaque = pixels[..., 3] >= OPAQUE
    if (~opaque).mean() <= TRANSPARENT_SHARE or not opaque.any():
        return None
    rows, columns = np.flatnonzero(opaque.any(axis=1)), np.flatnonzero(opaque.any(axis=0))
    inside = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    if min(opaque[inside].shape) < MIN_SIDE_PX or (~opaque[inside]).mean() > MOST_OF_CORNERS:
        return None
    return np.ascontiguousarray(pixels[inside][..., :3])


def is_rectangular(name: str | None) -> bool | None:
    """Return whether objects with a name may have an upright rectangular outline; None for an unknown name."""
    prior = find_prior(name)
    return None if prior is None else prior.shape in RECTANGULAR_SHAPES


def doubted_rectangle(matte: Matte, file: str, name: str | None) -> DoubtfulMatte:
    """Return the doubt about a cut-out that is an upright rectangle, if the user's ``name`` for the object is unknown."""
    remedy = (
        "name the object with --name" if name is None else f"the priors have no {name!r}; give a name that they have"
    )
    return DoubtfulMatte(
        "low_confidence_matte",
        f"{file}: its alpha channel is an upright rectangle: either the object (a book, a box) or a picture with"
        f" transparent bars; {remedy}, or crop off the bars",
        replace(matte, confidence=DOUBTFUL),
    )
