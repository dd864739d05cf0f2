"""The parts that questions share: phrases about the object, and its views as PNG, each with a caption."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

from manitwin.formats.image_file import png_of
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.annotators.protocol import PointsRequest, Subject
from manitwin.models.vlm.protocol import Picture
from manitwin.render.cameras import Camera, project
from manitwin.render.markers import draw_markers, font_px
from manitwin.render.raycast import merged, silhouette
from manitwin.render.renderer import BACKDROP

_FILLED = 0.9  # of a picture's side by the object cut out of a photo


def read_picture(path: Path) -> np.ndarray:
    """Read a picture as ``(H, W, 3) uint8``."""
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def view_caption(number: int, count: int, camera: Camera) -> str:
    """Return 'View 3 of 8, azimuth 30, elevation 20' in whole degrees: from where the camera looks."""
    x, y, z = camera.camera_to_object[:3, 2]
    azimuth = round(float(np.degrees(np.arctan2(y, x)))) % 360
    return f"View {number} of {count}, azimuth {azimuth}, elevation {round(float(np.degrees(np.arcsin(z))))}"


def clean_views(subject: Subject) -> list[str | Picture]:
    """Return each view's caption and picture."""
    parts: list[str | Picture] = []
    for number, (path, camera) in enumerate(zip(subject.views, subject.cameras, strict=True), 1):
        parts += [f"{view_caption(number, len(subject.views), camera)}:", Picture(png_of(read_picture(path)))]
    return parts


def cut_out_picture(rgba: np.ndarray, side_px: int) -> Picture:
    """Return the object of ``rgba (H, W, 4) uint8``, whose alpha is its mask, on the views' plain ground, ``side_px`` wide."""
    rows, columns = np.nonzero(rgba[..., 3] > 127)
    top, left = int(rows.min()), int(columns.min())
    height, width = int(rows.max()) + 1 - top, int(columns.max()) + 1 - left
    side = round(max(height, width) / _FILLED)
    seen = rgba[top : top + height, left : left + width].astype(np.float32)
    alpha = seen[..., 3:] / 255
    ground = np.empty((side, side, 3), np.float32)
    ground[...] = BACKDROP
    y, x = (side - height) // 2, (side - width) // 2
    ground[y : y + height, x : x + width] *= 1 - alpha
    ground[y : y + height, x : x + width] += alpha * seen[..., :3]
    whole = Image.fromarray(np.rint(ground).astype(np.uint8))
    return Picture(
        png_of(
            np.asarray(
                whole.resize((side_px, side_px), Image.Resampling.BOX if side > side_px else Image.Resampling.BILINEAR)
            )
        )
    )


def marked_views(request: PointsRequest, numbers: np.ndarray) -> list[str | Picture]:
    """Return each view clean and with the candidates that it shows, candidate ``i`` by the number ``numbers[i]``.

    Source: set-of-mark prompting (Yang et al. 2023, arXiv 2310.11441): marks by number, kept off what they mark; only what
    a view shows is marked in it.
    """
    subject = request.subject
    caster = RayCaster(merged(list(subject.parts)))
    parts: list[str | Picture] = []
    views = zip(subject.views, subject.cameras, request.visible, strict=True)
    for number, (path, camera, seen) in enumerate(views, 1):
        caption, clean = view_caption(number, len(subject.views), camera), read_picture(path)
        parts += [f"{caption}, clean:", Picture(png_of(clean))]
        if seen:
            parts += [
                f"{caption}, with markers:",
                Picture(png_of(_marked(clean, request, numbers, camera, seen, caster))),
            ]
        else:
            parts.append(f"{caption}: no marker can be seen from here.")
    return parts


def _marked(
    clean: np.ndarray,
    request: PointsRequest,
    numbers: np.ndarray,
    camera: Camera,
    seen: tuple[int, ...],
    caster: RayCaster,
) -> np.ndarray:
    # By number, not by candidate: where boxes compete for room, no place is favoured in all queries.
    ids = sorted(seen, key=lambda i: int(numbers[i]))
    return draw_markers(
        clean,
        project(request.positions_m[ids], camera)[0],
        [str(numbers[i]) for i in ids],
        occupied=silhouette(caster, camera),
        font_px=font_px(camera.height_px),
    )


def name_line(name: str | None) -> str:
    """Return the sentence that tells the model what the user calls the object."""
    return f"The user calls it: {' '.join(name.split())}." if name else "The user has not said what it is."


def size_phrase(extents_m: np.ndarray) -> str:
    """Return extents ``(3,)`` as '11.7 x 8.8 x 8.1 cm', along the object's own axes, the last one its height."""
    return " x ".join(f"{100 * float(extent):.1f}" for extent in extents_m) + " cm (the last one is its height)"


def extents_of(parts: tuple[trimesh.Trimesh, ...]) -> np.ndarray:
    """Return the extents ``(3,)`` of the visual meshes together."""
    corners = np.array([part.bounds for part in parts])
    return corners[:, 1].max(0) - corners[:, 0].min(0)


def length_phrase(length_m: float) -> str:
    """Return '80 mm'."""
    return f"{1000 * length_m:.0f} mm"
