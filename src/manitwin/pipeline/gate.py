"""Quality gate: a single object, a valid solid, a graspable size (paper, "Quality Verification")."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import trimesh

from manitwin.config import GateConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.geometry.mass_properties import solid_mass_properties
from manitwin.geometry.repair.components import separate_objects
from manitwin.models.annotators.descriptions import article
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.annotators.protocol import Annotator, QualityVerdict
from manitwin.pipeline.links import read_articulation
from manitwin.pipeline.object_state import cut_out_photos, load_solid, object_name, read_subject
from manitwin.pipeline.size_remarks import TRULY_LARGE
from manitwin.twin.record_values import Check

_ROUNDING = 1e-9  # relative to the largest second moment
_LITTLE_LARGER = 1.25
"""Times the largest objects of a kind: a slightly larger one is truly large, which no wrong unit would explain."""


class GateStage:
    """Reject meshes that by geometry are not a single solid object, then have the annotator judge the views.

    Field ``gate``: ``checks`` in the order they were made. A check that was not judged has ``passed`` None, never True.
    """

    name: ClassVar[str] = "gate"
    version: ClassVar[str] = "6"
    reads: ClassVar[tuple[str, ...]] = (
        "canonical.npz", "canonical.glb", "geometry", "views/", "cameras", "naming?", "photo.png?", "photos/?",
    )  # fmt: skip
    writes: ClassVar[tuple[str, ...]] = ("gate",)

    def __init__(self, settings: GateConfig, annotator: Annotator | None = None):
        """Take the settings and the annotator that judges the views; without one nothing is judged visually."""
        self.settings, self.annotator = settings, annotator
        self.backend = "geometry" if annotator is None else annotator.name
        self.model: str | None = None if annotator is None else annotator.model_for("quality")
        self.needs: Resource = "cpu" if annotator is None else annotator.needs
        self.expected_usd = 0.0 if annotator is None else annotator.expected_usd("quality")

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Return the field ``gate``. Raises Rejected with the first failed check, and BackendError from the annotator."""
        solid = load_solid(draft.path("canonical.npz"))
        geometry = draft.field("geometry")
        checks = [
            check_watertight(geometry["watertight"], geometry["repairs"]),
            check_positive_volume(solid, self.settings.min_thickness_share),
            check_plausible_size(
                solid,
                geometry["metric"],
                self.settings.min_longest_side_m,
                self.settings.max_longest_side_m,
                prior=find_prior(object_name(draft)),
                imported=draft.payload.given is not None,
            ),
            self._check_single_object(draft, solid),
        ]
        checks += annotator_checks(self._verdict(draft, geometry["metric"]))
        return {"gate": {"checks": [check.model_dump() for check in checks]}}

    def _check_single_object(self, draft: Draft, solid: trimesh.Trimesh) -> Check:
        """Check for a single object; links connected by joints count as one, regardless of gaps."""
        articulation = read_articulation(draft)
        if articulation is not None:
            joined = f"{len(articulation.links)} links, which joints hold together"
            return Check(name="single_object", passed=True, value=1.0, limit=1.0, message=joined)
        settings, rng = self.settings, np.random.default_rng(draft.seed)
        return check_single_object(solid, settings.max_gap_share, settings.object_share, rng)

    def _verdict(self, draft: Draft, metric: bool) -> QualityVerdict:
        if self.annotator is None:
            return QualityVerdict(None, None, "no annotator that sees")
        subject = read_subject(draft, solid="canonical.npz", visual="canonical.glb", metric=metric)
        return self.annotator.judge_quality(replace(subject, photos=cut_out_photos(draft)))


def check_watertight(watertight: bool, repairs: list[str]) -> Check:
    """Check that repair produced a closed surface. Raises Rejected ``not_watertight``."""
    if not watertight:
        done = "; ".join(repairs) or "nothing could be done"
        raise Rejected(
            "not_watertight", f"the surface is not closed after repair ({done}); close the mesh in a modeller", "gate"
        )
    return Check(name="watertight", passed=True)


def check_positive_volume(solid: trimesh.Trimesh, min_thickness_share: float) -> Check:
    """Check that no large part of the solid is inside out, and that it is thicker than a film. Raises Rejected ``degenerate``.

    Thickness is twice the volume over the area, that of a plate with the same volume and area. If density is nowhere negative,
    the second moment is positive in every direction (otherwise engines reject the inertia: A + B < C).
    """
    thickness_m = 2 * float(solid.volume) / float(solid.area) if solid.area > 0 else 0.0
    limit_m = min_thickness_share * float(np.linalg.norm(np.ptp(solid.vertices, axis=0)))
    if thickness_m <= limit_m:
        what = "inside out" if thickness_m < -limit_m else "as thin as a film"  # up to rounding
        detail = (
            f"the solid is {what}: mean thickness {thickness_m:.3g} m, at least {limit_m:.3g} m;"
            " give a mesh that encloses a volume"
        )
        raise Rejected("degenerate", detail, "gate")
    inertia = solid_mass_properties(solid, 1.0).inertia_kg_m2
    known = bool(np.isfinite(inertia).all())
    moments = np.linalg.eigvalsh(np.trace(inertia) / 2 * np.eye(3) - inertia) if known else np.full(3, np.nan)
    if not moments[0] >= -_ROUNDING * moments[-1]:
        detail = (
            "parts of the solid are inside out: its second moment is negative in one direction; give a closed mesh"
            " with all faces oriented outward"
        )
        raise Rejected("degenerate", detail, "gate")
    return Check(name="positive_volume", passed=True, value=thickness_m, limit=limit_m, message="mean thickness, m")


def check_plausible_size(
    solid: trimesh.Trimesh,
    metric: bool,
    smallest_m: float,
    largest_m: float,
    prior: Prior | None = None,
    *,
    imported: bool = False,
) -> Check:
    """Check the longest side if the scale is known. Raises Rejected ``absurd_size``.

    ``prior``: the usual sizes of such objects, which distinguishes an object that is too large for a gripper from a wrong unit.
    For an ``imported`` asset, the unit is that of its own file.
    """
    side_m = float(np.ptp(solid.vertices, axis=0).max())
    if not metric:
        return Check(
            name="plausible_size", passed=None, value=side_m, message="not judged: the mesh has no known scale yet"
        )
    if not smallest_m <= side_m <= largest_m:
        remedy = "give the right units (m, cm, mm), or the longest side in metres"
        if imported:
            remedy = (
                "the file states this size: correct its unit and import it again, or give the longest side in metres"
            )
        if side_m > largest_m and prior is None:
            remedy += "; an object that really is this large fits none of the shipped grippers"
        elif prior is not None and largest_m < side_m <= _LITTLE_LARGER * prior.longest_axis_m.high:
            remedy = f"{article(prior.category)} {prior.category} {TRULY_LARGE}"
        detail = f"the longest side is {side_m:.4g} m, valid are {smallest_m:g} to {largest_m:g} m; {remedy}"
        raise Rejected("absurd_size", detail, "gate")
    limit_m = smallest_m if side_m < np.sqrt(smallest_m * largest_m) else largest_m
    return Check(
        name="plausible_size", passed=True, value=side_m, limit=limit_m, message="longest side, m; the nearer limit"
    )


def check_single_object(
    solid: trimesh.Trimesh, gap_share: float, object_share: float, rng: np.random.Generator
) -> Check:
    """Check that all large parts touch, nearly touch or enclose each other. Raises Rejected ``several_objects``.

    It also rejects small parts that float so far away that they change the size of the object and what it rests on: pegs
    printed beside a tray, or crumbs of a scan.
    """
    gap_m = gap_share * float(np.linalg.norm(np.ptp(solid.vertices, axis=0)))
    found = separate_objects(solid, gap_m=gap_m, object_share=object_share, rng=rng)
    if found.count > 1:
        detail = f"{found.count} separate objects, more than {gap_m:.3g} m apart; give each object in a file of its own"
        raise Rejected("several_objects", detail, "gate")
    farthest = int(np.argmax(found.larger_m))
    if found.larger_m[farthest] > gap_m:
        side_m = float(np.ptp(solid.vertices, axis=0)[farthest])
        parts = "1 small part floats" if found.specks == 1 else f"{found.specks} small parts float"
        detail = (
            f"{parts} apart from it, so that it is {side_m:.3g} m from end to end and not"
            f" {side_m - found.larger_m[farthest]:.3g} m; delete what is not of it, and join what is, in a modeller"
        )
        raise Rejected("several_objects", detail, "gate")
    message = f"{found.specks} small parts float apart" if found.specks else ""
    return Check(name="single_object", passed=True, value=float(found.count), limit=1.0, message=message)


def annotator_checks(verdict: QualityVerdict) -> list[Check]:
    """Convert the annotator's verdict to checks. Raises Rejected if it is negative."""
    if verdict.single_object is False:
        raise Rejected("several_objects", f"not one coherent object in its pictures: {verdict.detail}", "gate")
    if verdict.visual_quality is False:
        raise Rejected("poor_quality", f"severe artifacts in its pictures: {verdict.detail}", "gate")
    return [
        Check(name=name, passed=passed, message=verdict.detail if passed else f"not judged: {verdict.detail}")
        for name, passed in (("one_coherent_object", verdict.single_object), ("visual_quality", verdict.visual_quality))
    ]
