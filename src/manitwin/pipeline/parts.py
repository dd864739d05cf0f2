"""Segmentation of the surface into parts: those of the template, else those found from its shape, else none."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import trimesh

from manitwin.config import NO_SETTINGS, Resource
from manitwin.engine.stage import Draft
from manitwin.geometry.distance import closest_faces
from manitwin.geometry.parts.segmentation import segment_by_rule, transfer_face_labels
from manitwin.geometry.parts.shape import measure_shape
from manitwin.models.annotators.part_names import part_name
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.prior_records import Prior
from manitwin.pipeline.object_state import load_solid, load_visual, object_name, read_given
from manitwin.twin.part_records import NO_PART, Part

PARTS_FILE = "parts.npz"
"""``visual (F,)`` and ``solid (S,)`` uint8: the part of each face of visual.glb and of solid.npz; 255 for no part."""


@dataclass(frozen=True)
class _PartLabels:
    """The parts of both meshes as indices into ``names``, with source and confidence."""

    names: tuple[str, ...]
    visual: np.ndarray
    solid: np.ndarray
    source: str
    confidence: float


class PartsStage:
    """Assign each face of ``visual.glb`` to a part, or to none. Writes ``parts.npz`` and the field ``parts``."""

    name: ClassVar[str] = "parts"
    version: ClassVar[str] = "16"
    reads: ClassVar[tuple[str, ...]] = (
        "solid.npz", "visual.glb", "points", "physical", "language", "geometry", "naming?",
    )  # fmt: skip
    writes: ClassVar[tuple[str, ...]] = (PARTS_FILE, "parts")
    needs: ClassVar[Resource] = "cpu"
    backend = "builtin"
    model: str | None = None

    settings = NO_SETTINGS

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Write ``parts.npz`` and return the table ``parts``, empty if there are no parts."""
        solid, meshes = load_solid(draft.path("solid.npz")), load_visual(draft.path("visual.glb"))
        visual = trimesh.Trimesh(
            *trimesh.util.append_faces([m.vertices for m in meshes], [m.faces for m in meshes]), process=False
        )
        told = (
            _template_parts(draft, solid, visual)
            or _parts_by_shape(draft, solid, visual)
            or _without_parts(solid, visual)
        )
        np.savez(folder / PARTS_FILE, visual=told.visual, solid=told.solid)
        return {"parts": [part.model_dump() for part in table_of(told.names, told.visual, visual, told)]}


def _without_parts(solid: trimesh.Trimesh, visual: trimesh.Trimesh) -> _PartLabels:
    none = [np.full(len(mesh.faces), NO_PART, np.uint8) for mesh in (visual, solid)]
    return _PartLabels((), none[0], none[1], "geometry", 0.0)


def _template_parts(draft: Draft, solid: trimesh.Trimesh, visual: trimesh.Trimesh) -> _PartLabels | None:
    """Return the parts of which the object was built; None if they are unknown, or repair has changed the faces."""
    given = read_given(draft)
    if given is None or given.parts is None or len(given.parts.of_face) != len(visual.faces):
        return None
    of_face = np.array(given.parts.of_face, dtype=np.int64)
    used = np.unique(of_face)
    labels = np.searchsorted(used, of_face).astype(np.uint8)
    names = tuple(given.parts.names[i] for i in used)
    return _PartLabels(names, labels, transfer_face_labels(labels, visual, solid), given.source, 1.0)


def _parts_by_shape(draft: Draft, solid: trimesh.Trimesh, visual: trimesh.Trimesh) -> _PartLabels | None:
    """Return the parts found by the rule for the object's form; None if it has no rule, or the surface does not show them."""
    usual = _prior(draft)
    if usual is None or usual.parts is None:
        return None
    center_m = np.array(draft.field("physical")["center_of_mass_m"])
    shape = measure_shape(solid, center_m, usual.head_end, usual.stands, np.random.default_rng(draft.seed))
    prior = usual.of_shape(shape)
    if prior.parts is None:
        return None
    found = segment_by_rule(solid, shape, prior.parts)
    if found is None:
        return None
    of_visual = transfer_face_labels(found.role, solid, visual)
    shown = np.unique(of_visual)
    points = draft.field("points")
    said = [*points["functional"], *(point for point in points["grasp"] if point["label"])]
    on = parts_at(np.array([point["position_m"] for point in said]), solid, found.role)
    roles = [found.roles[role] for role in shown]
    names = tuple(
        part_name(found.roles[role], prior, [p["label"] for p, at in zip(said, on, strict=True) if at == role], roles)
        for role in shown
    )
    places = np.full(len(found.roles), NO_PART, np.uint8)
    places[shown] = np.arange(len(shown))
    return _PartLabels(names, places[of_visual], places[found.role], f"geometry:{prior.parts}", found.confidence)


def _prior(draft: Draft) -> Prior | None:
    """Return the prior of the object's name, else of the category assigned to it."""
    return find_prior(object_name(draft)) or find_prior(draft.field("language")["category"])


def parts_at(points_m: np.ndarray, mesh: trimesh.Trimesh, labels: np.ndarray) -> np.ndarray:
    """Return the label of the mesh face nearest to each point ``(N, 3)``."""
    if not len(points_m):
        return np.zeros(0, labels.dtype)
    return np.asarray(labels[closest_faces(points_m, mesh)[0]])


def table_of(names: tuple[str, ...], labels: np.ndarray, visual: trimesh.Trimesh, told: _PartLabels) -> list[Part]:
    """Return the table of parts with their share of the visual surface and their centroids."""
    areas = np.asarray(visual.area_faces)
    rows = []
    for place, name in enumerate(names):
        mine = labels == place
        weights = areas[mine] if areas[mine].sum() > 0 else np.ones(int(mine.sum()))
        center = np.average(np.asarray(visual.triangles_center)[mine], axis=0, weights=weights)
        rows.append(
            Part(
                id=f"p{place}",
                name=name,
                source=told.source,
                confidence=round(told.confidence, 3),
                faces=int(mine.sum()),
                area_share=float(areas[mine].sum() / areas.sum()),
                centroid_m=center.tolist(),
            )
        )
    return rows
