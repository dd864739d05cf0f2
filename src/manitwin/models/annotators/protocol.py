"""The protocol of an annotator: the four questions that the paper asks a VLM."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol, runtime_checkable

import numpy as np

from manitwin.config import Resource
from manitwin.render.cameras import Camera
from manitwin.twin.import_record import ImportRecord
from manitwin.twin.point_records import FunctionalPoint, GraspPoint
from manitwin.twin.record import Language
from manitwin.twin.record_values import Estimate

if TYPE_CHECKING:
    import trimesh

    from manitwin.models.annotators.photo_light import PhotoLight


@dataclass(frozen=True)
class Subject:
    """The object as an annotator sees it.

    ``solid`` is the repaired watertight mesh and ``parts`` are the textured visual meshes, both in the object frame (Z-up),
    metres as far as known: ``metric`` says whether the scale is declared or only guessed. ``views`` are eight pictures, and
    ``cameras`` those that took them, in the same frame and unit as the meshes. ``given`` is what an imported asset says of
    itself, in the same frame; None for every other input. ``known_as`` is what an earlier answer took it for, ``photos`` are the
    photos that it was made of, cut out (RGBA), and ``size_estimated`` says that the metres are those of an estimate. ``likely``
    are names that it may have, each with its probability, where nobody has said one and no guess was likely enough. They have
    the colours of a photo as they are where they are ``photographed``; ``light`` is that photo's, None where it is not known.
    """

    name: str | None
    solid: trimesh.Trimesh
    parts: tuple[trimesh.Trimesh, ...]
    metric: bool
    views: tuple[Path, ...]
    cameras: tuple[Camera, ...]
    seed: int
    given: ImportRecord | None = None
    known_as: str | None = None
    photos: tuple[Path, ...] = ()
    size_estimated: bool = False
    likely: tuple[tuple[str, float], ...] = ()
    photographed: bool = False
    light: PhotoLight | None = None


@dataclass(frozen=True)
class QualityVerdict:
    """The two criteria of the paper's gate; None means not judged, and never means passed."""

    single_object: bool | None
    visual_quality: bool | None
    detail: str


@dataclass(frozen=True)
class PhysicalEstimates:
    """An annotator's estimates of size, mass, friction and how the mass is spread.

    ``longest_axis_m`` is the longest extent of the object as it stands (None: keep the scale as it is). ``wall_thickness_m`` is
    given for hollow things whose mesh is only an outer skin (None: the mesh is the solid matter, or full). ``mass_kg`` may be
    None where only ``bulk_density_kg_m3`` (mass per volume of the repaired mesh) is known: one of both is given.
    ``part_materials`` names a material of the priors by the role of a part, where parts are of unlike matter (None: not said).
    ``findings`` are contradictions that remained when the annotator was asked again; None: its answers were not examined.
    ``called`` is what it took the object for, where it looked; None: it did not.
    """

    longest_axis_m: Estimate | None
    mass_kg: Estimate | None
    bulk_density_kg_m3: Estimate | None
    friction_static: Estimate
    friction_dynamic: Estimate
    restitution: Estimate
    material: str
    wall_thickness_m: float | None
    findings: tuple[str, ...] | None = None
    part_materials: Mapping[str, str] | None = None
    called: str | None = None


@dataclass(frozen=True)
class PointsRequest:
    """The numbered candidates, and pictures on which they are marked."""

    subject: Subject
    positions_m: np.ndarray
    normals: np.ndarray
    marked_views: tuple[Path, ...]
    visible: tuple[tuple[int, ...], ...]
    center_of_mass_m: np.ndarray
    max_opening_m: float

    def place(self, candidate: int) -> dict[str, Any]:
        """Return the fields ``candidate``, ``position_m`` and ``normal`` of a point at a candidate."""
        position, normal = self.positions_m[candidate].tolist(), self.normals[candidate].tolist()
        return {"candidate": candidate, "position_m": position, "normal": normal}


@dataclass(frozen=True)
class SelectedPoints:
    """2-4 functional and 2-3 grasp points, each at a candidate; ``findings`` as those of ``PhysicalEstimates``.

    ``spare`` are the next best grasp points, best first: one of them takes the place of a point at which nothing holds.
    """

    functional: tuple[FunctionalPoint, ...]
    grasp: tuple[GraspPoint, ...]
    findings: tuple[str, ...] | None = None
    spare: tuple[GraspPoint, ...] = ()


@dataclass(frozen=True)
class CloserPlace:
    """A place of the surface that a closer look has found: position and outward normal, ``(3,)`` each."""

    position_m: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class CloserLook:
    """What a look at functional points from nearby found, and the pictures ``(H, W, 3) uint8`` it was shown, by the points' ids.

    A point that ``places`` does not name stays where it is.
    """

    places: Mapping[str, CloserPlace] = field(default_factory=dict)
    pictures: Mapping[str, np.ndarray] = field(default_factory=dict)


AnnotatorQuestion = Literal["quality", "physical", "captions", "points"]
"""The paper's four questions to a VLM."""


class Annotator(Protocol):
    """Answer the paper's four questions about an object. Raises BackendError where it cannot answer.

    ``picture_px`` is the side of the pictures that it reads best.
    """

    name: str
    needs: Resource
    picture_px: int

    def model_for(self, question: AnnotatorQuestion) -> str | None:
        """Return what decides the answer to a question besides the code: the model, and the prompt it is asked with."""
        ...

    def expected_usd(self, question: AnnotatorQuestion) -> float:
        """Return about what a question costs."""
        ...

    def judge_quality(self, subject: Subject) -> QualityVerdict:
        """Judge whether this is one coherent object, free of severe artifacts."""
        ...

    def estimate_physical(self, subject: Subject) -> PhysicalEstimates:
        """Estimate size, mass and friction."""
        ...

    def describe(self, subject: Subject, material: str, extents_m: np.ndarray) -> Language:
        """Describe category, color, material, size, shape and function in words."""
        ...

    def select_points(self, request: PointsRequest) -> SelectedPoints:
        """Choose functional and grasp points among the candidates."""
        ...


@runtime_checkable
class LooksCloser(Protocol):
    """An annotator that looks at functional points once more, from nearby."""

    def look_closer(self, request: PointsRequest, points: Sequence[FunctionalPoint]) -> CloserLook:
        """Return better places near the points, and the pictures that show them."""
        ...
