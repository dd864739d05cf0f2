"""Sampling of candidate points, and images with numbered markers (paper, "Candidate Point Sampling")."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import trimesh
from PIL import Image

from manitwin.config import CandidatesConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.geometry.candidate_sampling import sample_candidates
from manitwin.geometry.cavity import find_opening
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import sample_surface
from manitwin.pipeline.object_state import load_solid, load_visual, pictures
from manitwin.pipeline.views import write_webp
from manitwin.render.background_colors import marker_color
from manitwin.render.cameras import Camera, project
from manitwin.render.markers import draw_markers, font_px
from manitwin.render.raycast import merge_parts, silhouette, visibility_tolerance_m, visible_points


@dataclass(frozen=True)
class CandidatesStage:
    """Sample the surface, keep 42 candidate points, and mark them on the views (paper, "Candidate Point Sampling").

    Only points visible in some view are candidates, as an annotator can choose only those. Fields: ``candidates``
    ``{positions_m, normals}`` in the object frame; ``visible_candidates``, for each view the ids (rows of ``candidates``) drawn
    on it. The number on an image is the id.
    """

    settings: CandidatesConfig

    name: ClassVar[str] = "candidates"
    version: ClassVar[str] = "5"
    reads: ClassVar[tuple[str, ...]] = ("solid.npz", "visual.glb", "views/", "cameras", "physical")
    writes: ClassVar[tuple[str, ...]] = ("marked/", "candidates", "visible_candidates")
    needs: ClassVar[Resource] = "cpu"
    backend: ClassVar[str] = "builtin"
    model: ClassVar[str | None] = None

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Choose and mark the candidates. Raises Rejected if the solid deviates from the visible surface."""
        solid = load_solid(draft.path("solid.npz"))
        caster = RayCaster(merge_parts(load_visual(draft.path("visual.glb"))))
        scale = draft.field("physical")["scale_applied"]
        cameras = [Camera.from_json(value).scaled(scale) for value in draft.field("cameras")]
        positions, normals, visible = choose_candidates(
            solid,
            caster,
            cameras,
            samples=self.settings.samples,
            count=self.settings.count,
            rng=np.random.default_rng(draft.seed),
        )
        (folder / "marked").mkdir(parents=True, exist_ok=True)
        views = [np.asarray(Image.open(path).convert("RGB")) for path in pictures(draft.path("views/"), "rgb")]
        dot = marker_color(views).rgb
        for index, (view, camera, seen) in enumerate(zip(views, cameras, visible, strict=True)):
            marked = draw_markers(
                view,
                project(positions[seen], camera)[0],
                [str(i) for i in seen],
                occupied=silhouette(caster, camera),
                dot=dot,
                font_px=font_px(camera.width_px, camera.height_px),
            )
            write_webp(marked, folder / "marked" / f"marked_{index:02d}.webp", self.settings.webp_quality)
        return {
            "candidates": {"positions_m": positions.tolist(), "normals": normals.tolist()},
            "visible_candidates": [[int(i) for i in seen] for seen in visible],
        }


def choose_candidates(
    solid: trimesh.Trimesh,
    caster: RayCaster,
    cameras: list[Camera],
    *,
    samples: int,
    count: int,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Return positions ``(count, 3)`` m, outward normals ``(count, 3)``, and for each camera the ids of the visible points.

    The points are far from each other (paper, eq. 1), denser where the surface bends, at most a fifth on the underside, with
    one at the centre of a vessel's floor (``sample_candidates``). Raises Rejected if fewer than ``count`` samples are visible.
    """
    points, normals, _ = sample_surface(solid, samples, rng)
    tolerance_m = visibility_tolerance_m(solid.extents)
    seen = np.stack([visible_points(points, normals, camera, caster, tolerance_m) for camera in cameras])
    shown = np.flatnonzero(seen.any(0))
    if len(shown) < count:
        raise Rejected(
            "degenerate",
            f"only {len(shown)} of {samples} points on the repaired solid lie on the visible surface; close the"
            f" holes of the mesh",
            stage="gate",
        )
    chosen = shown[sample_candidates(points[shown], normals[shown], count, find_opening(solid))]
    return points[chosen], normals[chosen], [np.flatnonzero(row[chosen]) for row in seen]
