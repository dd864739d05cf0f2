"""Make convex hulls for physics, and measure how well they stand for the solid (paper, "3D Generation": sim-ready)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from scipy.spatial import QhullError

from manitwin.config import CollisionConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.geometry.cavity import find_opening
from manitwin.geometry.hulls.decomposition import convex_decomposition
from manitwin.geometry.hulls.error import hull_error
from manitwin.pipeline.object_state import load_solid

HULLS = "hulls.npz"


@dataclass(frozen=True)
class CollisionStage:
    """Decompose the solid into convex hulls that keep its opening open.

    Field ``collision``: twin.Hulls and ``method``, ``notes``. ``keeps_opening`` is None where the solid has no
    opening, else whether the hulls keep ``least_cavity_kept`` of it and a ball dropped in stays inside.
    """

    settings: CollisionConfig

    name: ClassVar[str] = "collision"
    version: ClassVar[str] = "3"
    reads: ClassVar[tuple[str, ...]] = ("solid.npz",)
    writes: ClassVar[tuple[str, ...]] = (HULLS, "collision")
    needs: ClassVar[Resource] = "cpu"
    backend: ClassVar[str] = "builtin"
    model: ClassVar[str | None] = None

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Write ``hulls.npz`` (``hull_00`` .. ``(V, 3)`` m) and return the field; raises Rejected for flat meshes."""
        settings = self.settings
        solid = load_solid(draft.path("solid.npz"))
        opening = find_opening(solid)
        try:
            found = convex_decomposition(
                solid,
                max_hulls=settings.max_hulls,
                max_vertices=settings.max_vertices,
                oversplit=settings.oversplit,
                opening=opening,
            )
        except QhullError as flat:
            raise Rejected(
                "degenerate", "the mesh is flat, no convex hull has volume; give one with walls", "gate"
            ) from flat
        error = hull_error(solid, found.hulls, opening, np.random.default_rng(draft.seed), settings.error_samples)
        keeps_opening, notes = None, list(found.notes)
        if opening is not None and error.cavity_kept is not None:
            from manitwin.physics.sapien.settle import ball_stays_inside  # the engine loads where a stage needs it

            ball_in = ball_stays_inside(found.hulls, opening)
            keeps_opening = ball_in and error.cavity_kept >= settings.least_cavity_kept
            if not keeps_opening:
                notes.append(f"opening: {error.cavity_kept:.0%} of its volume kept, ball stays inside: {ball_in}")
        arrays = {f"hull_{index:02d}": hull for index, hull in enumerate(found.hulls)}
        np.savez(folder / HULLS, **arrays)  # type: ignore[arg-type]  # numpy's stub takes the names for its own flags
        return {
            "collision": {
                "count": len(found.hulls),
                "max_vertices": max(len(hull) for hull in found.hulls),
                "volume_ratio": error.volume_ratio,
                "surface_error_p95_m": error.surface_error_p95_m,
                "surface_uncovered_max_m": error.surface_uncovered_max_m,
                "keeps_opening": keeps_opening,
                "cavity_kept": error.cavity_kept,
                "method": found.method,
                "notes": notes,
            }
        }
