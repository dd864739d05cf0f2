"""Pictures for questions: PNG views with captions, without or with numbered markers, and matted photos."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from manitwin.formats.image_file import png_of
from manitwin.geometry.boxes import longest_edges
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.annotators.protocol import PointsRequest, Subject
from manitwin.models.vlm.protocol import Picture
from manitwin.render.background_colors import background_of_pixels, marker_color
from manitwin.render.cameras import Camera, project
from manitwin.render.markers import draw_markers, font_px
from manitwin.render.raycast import merge_parts, silhouette
from manitwin.render.scale_marks import best_camera, draw_dimension, draw_scale_bar

MOST_PHOTOS = 8
"""Largest number of photos in one question: servers limit the images of a request, and eight views follow the photos."""
_FILLED = 0.9  # share of a picture's side that the object of a photo fills


def read_picture(path: Path) -> np.ndarray:
    """Read a picture as ``(H, W, 3) uint8``."""
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def view_caption(number: int, count: int, camera: Camera) -> str:
    """Return 'View 3 of 8, azimuth 30, elevation 20' with the camera's direction in whole degrees."""
    x, y, z = camera.camera_to_object[:3, 2]
    azimuth = round(float(np.degrees(np.arctan2(y, x)))) % 360
    return f"View {number} of {count}, azimuth {azimuth}, elevation {round(float(np.degrees(np.arcsin(z))))}"


def clean_views(subject: Subject) -> list[str | Picture]:
    """Return each view's caption and picture, without markers."""
    parts: list[str | Picture] = []
    for number, (path, camera) in enumerate(zip(subject.views, subject.cameras, strict=True), 1):
        parts += [f"{view_caption(number, len(subject.views), camera)}:", Picture(png_of(read_picture(path)))]
    return parts


def longest_extent_view(subject: Subject) -> list[str | Picture]:
    """Return the view that shows the object's longest extent best, with that extent drawn into it, and its caption.

    The line is labelled with its length if the scale is declared, else with the name of the answer's field.
    """
    points = np.concatenate([part.vertices for part in subject.parts])
    edges = longest_edges(points)
    view, edge = best_camera(edges, subject.cameras)
    clean, camera = read_picture(subject.views[view]), subject.cameras[view]
    color = marker_color([clean])
    length_m = float(np.linalg.norm(edges[edge, 1] - edges[edge, 0]))
    label = f"{100 * length_m:.1f} cm" if subject.metric else "length_m"
    drawn = draw_dimension(clean, edges[edge], camera, label, color.rgb)
    caption = f"One of these views, with what length_m measures as a {color.name} line between two ticks:"
    return [caption, Picture(png_of(drawn))]


def photos_beside(subject: Subject, side_px: int) -> list[str | Picture]:
    """Return the matted photos from which the object was made, each with a caption.

    If there are more than ``MOST_PHOTOS``, an even selection is returned. Raises OSError for a photo that cannot be read.
    """
    count = len(subject.photos)
    shown = min(count, MOST_PHOTOS)
    parts: list[str | Picture] = []
    for index in (number * count // shown for number in range(shown)):
        which = "The photo" if count == 1 else f"Photo {index + 1} of {count}"
        with Image.open(subject.photos[index]) as image:
            parts += [f"{which} that it was made of:", cut_out_picture(np.asarray(image.convert("RGBA")), side_px)]
    return parts


def cut_out_picture(rgba: np.ndarray, side_px: int) -> Picture:
    """Return the object of ``rgba (H, W, 4) uint8``, whose alpha is its mask, on a plain background, ``side_px`` wide."""
    inside = rgba[..., 3] > 127
    rows, columns = np.nonzero(inside)
    top, left = int(rows.min()), int(columns.min())
    height, width = int(rows.max()) + 1 - top, int(columns.max()) + 1 - left
    side = round(max(height, width) / _FILLED)
    seen = rgba[top : top + height, left : left + width].astype(np.float32)
    alpha = seen[..., 3:] / 255
    ground = np.empty((side, side, 3), np.float32)
    ground[...] = background_of_pixels(rgba[inside][:, :3])
    y, x = (side - height) // 2, (side - width) // 2
    ground[y : y + height, x : x + width] *= 1 - alpha
    ground[y : y + height, x : x + width] += alpha * seen[..., :3]
    whole = Image.fromarray(np.rint(ground).astype(np.uint8))
    resampling = Image.Resampling.BOX if side > side_px else Image.Resampling.BILINEAR
    return Picture(png_of(np.asarray(whole.resize((side_px, side_px), resampling))))


def marked_views(
    request: PointsRequest,
    numbers: np.ndarray,
    pictures: Sequence[np.ndarray],
    cameras: Sequence[Camera],
    visible: Sequence[tuple[int, ...]],
) -> tuple[list[str | Picture], str]:
    """Return each view without and with its visible candidates marked, and the name of the markers' colour.

    The last picture is the first view with a scale bar. Candidate ``i`` has the marker ``numbers[i]``. Source: set-of-mark
    prompting (Yang et al. 2023, arXiv 2310.11441): numbered marks that do not cover the marked places; only candidates
    visible in a view are marked.
    """
    caster = RayCaster(merge_parts(list(request.subject.parts)))
    color = marker_color(pictures)
    parts: list[str | Picture] = []
    for number, (clean, camera, seen) in enumerate(zip(pictures, cameras, visible, strict=True), 1):
        caption = view_caption(number, len(cameras), camera)
        parts += [f"{caption}, clean:", Picture(png_of(clean))]
        if not seen:
            parts.append(f"{caption}: no marker can be seen from here.")
            continue
        # ordered by number, not by candidate, so that label placement does not favour the same places in all queries
        ids = sorted(seen, key=lambda i: int(numbers[i]))
        marked = draw_markers(
            clean,
            project(request.positions_m[ids], camera)[0],
            [str(numbers[i]) for i in ids],
            occupied=silhouette(caster, camera),
            dot=color.rgb,
            font_px=font_px(camera.width_px, camera.height_px),
        )
        parts += [f"{caption}, with markers:", Picture(png_of(marked))]
    return [*parts, *_scale_view(request.subject, pictures[0], cameras[0])], color.name


def _scale_view(subject: Subject, clean: np.ndarray, camera: Camera) -> list[str | Picture]:
    """Return a view with a scale bar, and its caption; the object's size is known before its points are asked for."""
    middle_m = np.mean([part.bounds for part in subject.parts], axis=(0, 1))
    bar = draw_scale_bar(clean, camera, middle_m)
    return ["The first view with a scale bar, which holds at the object's middle:", Picture(png_of(bar))]
