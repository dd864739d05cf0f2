"""Rendering of eight views of the object, for people and annotators (paper, "Physical Property Estimation")."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import trimesh
from PIL import Image, WebPImagePlugin

from manitwin.config import Resource, ViewsConfig
from manitwin.engine.stage import Draft
from manitwin.pipeline.object_state import load_visual
from manitwin.render.background_colors import background_for
from manitwin.render.cameras import Camera, orbit_cameras
from manitwin.render.raycast import merge_parts
from manitwin.render.renderer import BACKDROP, shared_renderer
from manitwin.render.visibility import is_closed_and_outward

VIEWS = 8
"""Number of views (paper, "Physical Property Estimation")."""


class ViewsStage:
    """Render ``canonical.glb`` from eight sides (paper, "Physical Property Estimation").

    Field ``cameras``: for each view ``camera_to_object`` (OpenGL axes, translation in the unit of the canonical mesh),
    ``fov_y_rad``, ``width_px``, ``height_px``.
    """

    name: ClassVar[str] = "views"
    version: ClassVar[str] = "6"
    reads: ClassVar[tuple[str, ...]] = ("canonical.glb",)
    writes: ClassVar[tuple[str, ...]] = ("views/", "cameras")
    needs: ClassVar[Resource] = "cpu"
    backend = "sapien"
    model: str | None = None

    def __init__(self, settings: ViewsConfig, size_px: int):
        """Take the settings, and the image size to use if they do not state one."""
        self.settings = settings.model_copy(update={"size_px": settings.size_px or size_px})
        self._size_px = settings.size_px or size_px

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Render the views. Raises RendererMissing if no renderer is available."""
        parts = load_visual(draft.path("canonical.glb"))
        cameras, pictures = draw_views(parts, self.settings, self._size_px)
        (folder / "views").mkdir(parents=True, exist_ok=True)
        for index, picture in enumerate(pictures):
            write_webp(picture, folder / "views" / f"rgb_{index:02d}.webp", self.settings.webp_quality)
        return {"cameras": [camera.to_json() for camera in cameras]}


def draw_views(
    parts: Sequence[trimesh.Trimesh], settings: ViewsConfig, size_px: int
) -> tuple[list[Camera], list[np.ndarray]]:
    """Return eight cameras around the meshes and their images ``(H, W, 3) uint8``, on a background that contrasts with the
    object.
    """
    points = np.concatenate([part.vertices for part in parts])
    cameras = orbit_cameras(
        points, fov_y_deg=settings.fov_y_deg, size_px=size_px, elevations_deg=settings.elevations_deg
    )
    frames = shared_renderer().render(parts, cameras, with_backs=not is_closed_and_outward(merge_parts(list(parts))))
    ground = background_for(frames)
    return cameras, [frame.composited_over(BACKDROP, ground) for frame in frames]


def write_webp(picture: np.ndarray, path: Path, quality: int) -> None:
    """Write an image ``(H, W, 3) uint8`` as WebP; equal images give equal bytes."""
    # Method 2 of 6 takes half the time of 4, with files 5 % larger (measured on 32 views).
    Image.fromarray(picture).save(path, WebPImagePlugin.WebPImageFile.format, quality=quality, method=2)
