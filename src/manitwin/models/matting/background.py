"""Background model of a photo: a few smooth colour surfaces fitted to its border, and each pixel's distance from them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

FIT_SIDE_PX = 128
MAX_SURFACES = 3
BORDER_SHARE = 0.04
MIN_SHADE, MAX_SHADE = 0.25, 0.985  # ratio of reflected light of a shadow in a lit scene
NEUTRAL = 0.08  # spread of the channels' ratios in a shadow with one light source
NOISE_FLOOR_LAB = 0.5  # quantization noise of an 8-bit channel, present even on a perfectly flat border


@dataclass(frozen=True)
class Background:
    """Background model and its comparison with the pixels of the photo.

    - ``lab (H, W, 3)``: the photo in CIE L*a*b*
    - ``expected (H, W, 3)``: the background colour at each pixel
    - ``residual (H, W, 3)``: the photo, slightly blurred, minus ``expected``
    - ``distance (H, W)``: Mahalanobis distance from the background at fine scale (about one pixel)
    - ``coarse_distance (H, W)``: the same for the blurred photo
    - ``noise_lab``: spread of the background in L*a*b* units
    - ``unexplained``: share of the border that no surface explains
    - ``surfaces``: number of surfaces
    - ``border (H, W)``: mask of the border ring
    - ``seam (H, W)``: mask of the lines where two surfaces meet
    """

    lab: np.ndarray
    expected: np.ndarray
    residual: np.ndarray
    distance: np.ndarray
    coarse_distance: np.ndarray
    noise_lab: float
    unexplained: float
    surfaces: int
    border: np.ndarray
    seam: np.ndarray

    @cached_property
    def light_ratio(self) -> np.ndarray:
        """Linear light (H, W, 3) of each pixel over that of the expected background."""
        smooth = np.clip(cv2.cvtColor(cv2.GaussianBlur(self.lab, (0, 0), 0.8), cv2.COLOR_LAB2RGB), 0, 1)
        expected = np.clip(cv2.cvtColor(self.expected, cv2.COLOR_LAB2RGB), 0, 1)
        return np.asarray((cv2.pow(smooth, 2.2) + 2e-3) / (cv2.pow(expected, 2.2) + 2e-3))

    @cached_property
    def light(self) -> np.ndarray:
        """Mean over the channels of ``light_ratio`` (H, W)."""
        return total(self.light_ratio) / 3

    @cached_property
    def tint(self) -> np.ndarray:
        """Deviation (H, W) of each pixel's ``light_ratio`` from an equal ratio in all channels, relative to ``light``."""
        return np.asarray(length(self.light_ratio / self.light[..., None] - 1) / np.sqrt(3))

    @cached_property
    def shade(self) -> np.ndarray:
        """Mask (H, W) of pixels with the background's colour, darkened without tint."""
        return (self.light > MIN_SHADE) & (self.light < MAX_SHADE) & (self.tint < NEUTRAL)


def total(vectors: np.ndarray) -> np.ndarray:
    """Return the sum (...) over the components of vectors (..., 3); five times as fast as ``numpy.sum``."""
    return np.asarray(vectors[..., 0] + vectors[..., 1] + vectors[..., 2])


def length(vectors: np.ndarray) -> np.ndarray:
    """Return the length (H, W) of vectors (H, W, 3); four times as fast as ``numpy.linalg.norm``."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def border_ring(height: int, width: int) -> np.ndarray:
    """Return the mask (H, W) of the outer 4 % of an image, at least three pixels wide."""
    ring = np.zeros((height, width), bool)
    thickness = max(3, round(BORDER_SHARE * max(height, width)))
    ring[:thickness] = ring[-thickness:] = True
    ring[:, :thickness] = ring[:, -thickness:] = True
    return ring


def connected_to(mask: np.ndarray, seed: np.ndarray) -> np.ndarray:
    """Return the 4-connected components of ``mask`` that contain a pixel of ``seed``."""
    _, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=4)
    reached = np.unique(labels[seed & mask])
    return np.isin(labels, reached[reached > 0])


def model_background(rgb: np.ndarray) -> Background:
    """Fit the background of ``rgb`` (H, W, 3) uint8 sRGB.

    Up to three cubic colour surfaces in L*a*b* are grown, each from the most frequent border colour not yet explained. They
    model light falloff, vignetting and a wall that meets a table as background.
    """
    lab = cv2.cvtColor(rgb.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    height, width = lab.shape[:2]
    fits, unexplained = _fit_surfaces(lab)
    border = border_ring(height, width)
    surfaces = [_surface(height, width, coefficients, degree) for coefficients, degree in fits]
    fine, residual, expected, noise = _distance(lab, 0.8, surfaces, border)
    coarse, _, _, _ = _distance(lab, 2.5, surfaces, border)
    seam = np.zeros((height, width), bool)
    if len(surfaces) > 1:
        fine, coarse, seam = _explain_seams(lab, surfaces, fine, coarse, noise, border)
    return Background(lab, expected, residual, fine, coarse, noise, unexplained, len(surfaces), border, seam)


def _surface(height: int, width: int, coefficients: np.ndarray, degree: int) -> np.ndarray:
    """Evaluate a colour surface (H, W, 3) float32, term by term: all terms of a 1024 px picture at once would take 60 MB."""
    x, y = _axis(width), _axis(height)[:, None]
    channels = np.zeros((3, height, width))
    for (i, j), coefficient in zip(_powers(degree), coefficients, strict=True):
        term = x**i * y**j
        for channel, factor in zip(channels, coefficient, strict=True):  # a loop over channels is three times as fast
            channel += term * factor
    return np.ascontiguousarray(np.moveaxis(channels, 0, 2), np.float32)


def _basis(height: int, width: int, degree: int) -> np.ndarray:
    x, y = _axis(width), _axis(height)[:, None]
    return np.stack([x**i * y**j for i, j in _powers(degree)], -1)


def _axis(length: int) -> np.ndarray:
    return np.linspace(-1, 1, length)


def _powers(degree: int) -> list[tuple[int, int]]:
    return [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]


def _fit_surfaces(lab: np.ndarray) -> tuple[list[tuple[np.ndarray, int]], float]:
    """Fit surfaces at low resolution; return (coefficients, degree) of each and the unexplained share of the border."""
    scale = FIT_SIDE_PX / max(lab.shape[:2])
    small = cv2.resize(lab, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1 else lab
    height, width = small.shape[:2]
    colours = small.reshape(-1, 3).astype(float)
    ring = border_ring(height, width).ravel()
    left = ring.copy()
    bases = {degree: _basis(height, width, degree).reshape(height * width, -1) for degree in (1, 2, 3)}
    fits: list[tuple[np.ndarray, int]] = []
    while len(fits) < MAX_SURFACES and (not fits or left.sum() > 0.05 * ring.sum()):
        coefficients, degree, distance = _grow_surface(colours, left, (height, width), bases)
        explained = left & (distance < 6)
        if fits and explained.sum() < 0.04 * ring.sum():
            break
        fits.append((coefficients, degree))
        left &= ~explained
    return fits, float(left.sum() / ring.sum())


def _grow_surface(
    colours: np.ndarray, left: np.ndarray, shape: tuple[int, int], bases: dict[int, np.ndarray]
) -> tuple[np.ndarray, int, np.ndarray]:
    """Grow one surface from the most frequent border colour: fit, add connected pixels that it explains, raise the degree.

    ``bases`` holds the polynomial terms (H * W, K) by degree. Returns coefficients, degree and each pixel's distance.
    """
    ring_colours = colours[left]
    modes = ring_colours[:: max(1, len(ring_colours) // 200)]
    weights = np.array([0.5, 1.0, 1.0])  # lightness varies more than colour along a background
    near = total((ring_colours[:, None] - modes[None]) ** 2 * weights) < 49
    start = modes[near.sum(0).argmax()]
    used = left & (total((colours - start) ** 2 * weights) < 100)
    for step in range(20):
        degree = 1 if step < 5 else 2 if step < 12 else 3
        basis = bases[degree]
        a = basis[used]
        coefficients = np.linalg.solve(a.T @ a + 1e-4 * len(a) * np.eye(a.shape[1]), a.T @ colours[used])
        residual = colours - basis @ coefficients
        spread = 1.4826 * np.median(np.abs(residual[used] - np.median(residual[used], 0)), axis=0) + 0.3
        distance = np.sqrt(total(residual**2 / spread**2))
        inlier = distance < max(4.5, 9 - 0.5 * step)
        grown = connected_to(inlier.reshape(shape), left.reshape(shape)).ravel()
        if grown.sum() < 0.02 * len(colours):
            break
        used = grown
    return coefficients, degree, distance


def _distance(
    lab: np.ndarray, blur_px: float, surfaces: list[np.ndarray], border: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return the Mahalanobis distance to the nearest surface, the residual from it, its colours, and the largest noise."""
    smooth = cv2.GaussianBlur(lab, (0, 0), blur_px)
    floor = NOISE_FLOOR_LAB**2 * np.eye(3)
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    noises = []
    for surface in surfaces:
        residual = smooth - surface
        used = border & (length(residual) < 12)
        covariance = np.eye(3)
        for _ in range(4):
            if used.sum() < 50:
                break
            covariance = np.cov(residual[used].T)
            distance = _mahalanobis(residual, covariance + floor)
            used = border & (distance < 4)
        found.append((_mahalanobis(residual, covariance + floor), residual, surface))
        noises.append(float(np.sqrt(np.trace(covariance) / 3)))
    nearest = np.argmin([f[0] for f in found], axis=0)

    def pick(index: int) -> np.ndarray:
        picked = found[0][index]
        for number in range(1, len(found)):
            here = nearest == number
            picked = np.where(here if picked.ndim == 2 else here[..., None], found[number][index], picked)
        return picked

    return pick(0), pick(1), pick(2), max(noises)


def _mahalanobis(residual: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    whitening = np.linalg.cholesky(np.linalg.inv(covariance)).astype(np.float32)
    return length(cv2.transform(residual, whitening.T))


def _explain_seams(
    lab: np.ndarray, surfaces: list[np.ndarray], fine: np.ndarray, coarse: np.ndarray, noise: float, border: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Classify the mixed colours along a line where two surfaces meet as background; return both distances and the seam mask."""
    smooth = cv2.GaussianBlur(lab, (0, 0), 0.8)
    plain = connected_to(fine < 3.5, border)
    seam = np.zeros(plain.shape, bool)
    near = np.ones((13, 13), np.uint8)
    for i in range(len(surfaces)):
        for j in range(i):
            step = surfaces[i] - surfaces[j]
            share = total((smooth - surfaces[j]) * step) / np.maximum(total(step**2), 1e-6)
            mixed = length(smooth - surfaces[j] - np.clip(share, 0, 1)[..., None] * step)
            both = [cv2.dilate((plain & (side < 0.5)).astype(np.uint8), near) > 0 for side in (share, 1 - share)]
            seam |= both[0] & both[1] & (mixed < 4 * max(noise, NOISE_FLOOR_LAB))
    return np.where(seam, np.minimum(fine, 3), fine), np.where(seam, np.minimum(coarse, 3), coarse), seam
