"""Protocol of an annotator: the four questions that the paper asks a VLM, with their answers."""

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
    """The object to annotate.

    - ``name``: name given by the user, or None
    - ``solid``: repaired watertight mesh; ``parts``: textured visual meshes; both in the object frame (Z-up), in metres if
      ``metric``
    - ``metric``: whether the scale is declared; otherwise it is guessed
    - ``views``: eight pictures; ``cameras``: their cameras, in the frame and unit of the meshes
    - ``given``: annotations of an imported asset, in the same frame; None for other inputs
    - ``known_as``: name that an earlier answer gave the object
    - ``photos``: the matted photos (RGBA) from which the object was made
    - ``size_estimated``: whether the metres come from an estimate
    - ``likely``: candidate names with probabilities, if there is no name and no guess was probable enough
    - ``photographed``: whether the meshes have the uncorrected colours of a photo; ``light``: the light of that photo, None
      if unknown
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
    """Verdict on the two criteria of the paper's quality gate; None means not judged, not passed."""

    single_object: bool | None
    visual_quality: bool | None
    detail: str


@dataclass(frozen=True)
class PhysicalEstimates:
    """Estimates of size, mass, friction and mass distribution.

    - ``longest_axis_m``: longest extent of the object in its resting pose (None: keep the scale)
    - ``mass_kg`` and ``bulk_density_kg_m3`` (mass per volume of the repaired mesh): at least one is given
    - ``wall_thickness_m``: for hollow objects whose mesh is only the outer skin (None: the mesh is solid material, or full)
    - ``part_materials``: material of the priors by part role, if parts differ in material (None: not stated)
    - ``findings``: contradictions that remained after asking again; None if answers were not examined
    - ``called``: name that the annotator gave the object from its pictures; None if it did not look
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
    """Numbered candidate points, and pictures in which they are marked.

    ``positions_m`` and ``normals`` are ``(N, 3)`` in the object frame; ``visible`` has the indices of the candidates seen in
    each view; ``max_opening_m`` is the opening of the gripper.
    """

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
    """2-4 functional and 2-3 grasp points, each at a candidate; ``findings`` as in ``PhysicalEstimates``.

    ``spare`` are the next best grasp points, best first; they replace points at which no grasp holds.
    """

    functional: tuple[FunctionalPoint, ...]
    grasp: tuple[GraspPoint, ...]
    findings: tuple[str, ...] | None = None
    spare: tuple[GraspPoint, ...] = ()


@dataclass(frozen=True)
class CloserPlace:
    """A place on the surface that a closer look has found: position and outward normal, ``(3,)`` each."""

    position_m: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class CloserLook:
    """Result of a close-up look at functional points: improved places, and the pictures ``(H, W, 3) uint8`` shown, by point id.

    A point that is not in ``places`` stays where it is.
    """

    places: Mapping[str, CloserPlace] = field(default_factory=dict)
    pictures: Mapping[str, np.ndarray] = field(default_factory=dict)


AnnotatorQuestion = Literal["quality", "physical", "captions", "points"]
"""The paper's four questions to a VLM."""


class Annotator(Protocol):
    """Protocol of an annotator that answers the paper's four questions. Raises BackendError if it cannot answer.

    ``picture_px`` is the preferred side of its pictures in pixels.
    """

    name: str
    needs: Resource
    picture_px: int

    def model_for(self, question: AnnotatorQuestion) -> str | None:
        """Return what besides the code determines the answer to a question: the model and the prompt."""
        ...

    def expected_usd(self, question: AnnotatorQuestion) -> float:
        """Return the approximate cost of a question in dollars."""
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
    """An annotator that refines functional points in close-up pictures."""

    def look_closer(self, request: PointsRequest, points: Sequence[FunctionalPoint]) -> CloserLook:
        """Return better places near the points, and the pictures that show them."""
        ...
