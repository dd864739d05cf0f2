"""Collision geometry: convex decomposition of the solid, with measured error (paper, "3D Generation": sim-ready)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import trimesh
from scipy.spatial import QhullError

from manitwin.config import CollisionConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.geometry.cavity import Opening, find_opening
from manitwin.geometry.hulls.decomposition import Decomposition, convex_decomposition
from manitwin.geometry.hulls.error import hull_error
from manitwin.geometry.hulls.through_holes import holes_kept
from manitwin.pipeline.links import face_links, link_solids, read_articulation, shape_of_link
from manitwin.pipeline.object_state import load_solid

HULLS = "hulls.npz"


@dataclass(frozen=True)
class CollisionStage:
    """Decompose the solid, or each of its links, into convex hulls that keep its opening open.

    Field ``collision``: twin.Hulls, and ``method``, ``notes``. ``keeps_opening`` is None if the solid has no opening; otherwise
    whether the hulls keep ``least_cavity_kept`` of its volume and a ball dropped in stays inside. ``holes_kept`` is the open
    share of the through hole that the hulls close most; None without holes.
    """

    settings: CollisionConfig

    name: ClassVar[str] = "collision"
    version: ClassVar[str] = "4"
    reads: ClassVar[tuple[str, ...]] = ("solid.npz", "canonical.npz", "geometry")
    writes: ClassVar[tuple[str, ...]] = (HULLS, "collision")
    needs: ClassVar[Resource] = "cpu"
    backend: ClassVar[str] = "builtin"
    model: ClassVar[str | None] = None

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Write ``hulls.npz`` (``hull_00`` .. ``(V, 3)`` m) and return the field. Raises Rejected for flat meshes."""
        settings = self.settings
        solid = load_solid(draft.path("solid.npz"))
        opening = find_opening(solid)
        articulation = read_articulation(draft)
        try:
            if articulation is None:
                found, links = self._decomposed(solid, settings.max_hulls, opening), {}
            else:
                labels = face_links(draft, articulation, solid)
                found, table = self._by_link(link_solids(solid, labels, len(articulation.links)))
                links = {"links": table}
        except QhullError as flat:
            raise Rejected(
                "degenerate", "the mesh is flat, so no convex hull has a volume; give a mesh with walls", "gate"
            ) from flat
        error = hull_error(solid, found.hulls, opening, np.random.default_rng(draft.seed), settings.error_samples)
        keeps_opening, notes = None, list(found.notes)
        if opening is not None and error.cavity_kept is not None:
            # imported here, as it loads the physics engine
            from manitwin.physics.sapien.settle import ball_stays_inside

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
                "holes_kept": holes_kept(solid, found.hulls),
                "method": found.method,
                "notes": notes,
                **links,
            }
        }

    def _decomposed(self, solid: trimesh.Trimesh, most: int, opening: Opening | None) -> Decomposition:
        settings = self.settings
        return convex_decomposition(
            solid, max_hulls=most, max_vertices=settings.max_vertices, oversplit=settings.oversplit, opening=opening
        )

    def _by_link(self, solids: list[trimesh.Trimesh]) -> tuple[Decomposition, list[dict[str, Any]]]:
        """Return the hulls of all links, each belonging to one link, and a table with the hulls and mass share of each link."""
        most = max(1, self.settings.max_hulls // len(solids))
        found = [self._decomposed(solid, most, find_opening(solid)) for solid in solids]
        hulls = [hull for each in found for hull in each.hulls]
        ends = np.cumsum([len(each.hulls) for each in found])
        numbers = np.split(np.arange(len(hulls)), ends[:-1])
        notes = list(dict.fromkeys(note for each in found for note in each.notes))
        table = [shape_of_link(solid, own.tolist()) for solid, own in zip(solids, numbers, strict=True)]
        return replace(found[0], hulls=tuple(hulls), notes=tuple(notes)), table
