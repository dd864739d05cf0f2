"""The twin's schema: the one copy in code of what a finished twin says about itself.

SI units, object frame (right-handed, +Z up, origin at the bottom centre), quaternions wxyz.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from manitwin.twin.fill_records import Filling
from manitwin.twin.grasp_summary import GraspSummary
from manitwin.twin.link_records import FACE_LINKS, MAX_LINKS, Joint, Link, require_tree
from manitwin.twin.migration import SCHEMA_VERSION
from manitwin.twin.part_records import FACE_PARTS, NO_PART, Part
from manitwin.twin.point_records import Points
from manitwin.twin.record_values import (
    LARGEST_KG,
    LARGEST_M,
    Check,
    Estimate,
    FileBelow,
    Finite,
    FolderName,
    Matrix3,
    Matrix4,
    Quaternion,
    Record,
    Unit,
    Vector3,
)

Status = Literal["accepted", "rejected"]

_OF_EVERY_STAGE = frozenset({"too_large"})  # any stage's process has a limit of memory
REJECTION_REASONS: dict[str, frozenset[str]] = {
    stage: reasons | _OF_EVERY_STAGE
    for stage, reasons in {
        "input": frozenset({"unreadable", "empty", "wrong_type", "too_small", "animated", "no_faces", "not_finite"}),
        "generate": frozenset({"no_object", "several_objects", "low_confidence_matte", "generator_failed"}),
        "gate": frozenset({"several_objects", "not_watertight", "degenerate", "absurd_size", "poor_quality"}),
        "physical": frozenset({"implausible_mass", "implausible_size"}),
        "grasps": frozenset({"too_wide", "too_thin", "no_proposal"}),
        "verify": frozenset({"none_held"}),
        "placement": frozenset({"no_stable_pose"}),
    }.items()
}


class Rejection(Record):
    """The reason for which there is no twin of this input."""

    stage: str
    reason: str
    detail: str

    @model_validator(mode="after")
    def _known(self) -> Rejection:
        if self.reason not in REJECTION_REASONS.get(self.stage, frozenset()):
            raise ValueError(f"stage {self.stage!r} has no rejection reason {self.reason!r}")
        return self


class StatedCameras(Record):
    """The file that stated the cameras of several photos; they are in the archive, as ``transforms.json`` with z up.

    ``format``: transforms.json | colmap. ``up`` and ``unit`` say which way is up in the file and what its unit is, and who says
    so; ``unit_m`` is that in metres, None where nobody knows, so that the size is no measured one.
    """

    file: str
    format: str
    up: str
    roll_deg: Finite
    unit: str
    unit_m: Finite | None


class Source(Record):
    """The input that the twin was made of; ``variation`` counts the things made of one text.

    ``photos``: several photos of one thing, in the archive ``file`` in their order; ``turns_deg`` is the camera's turn about the
    vertical in each, counter-clockwise seen from above, where they were stated; ``poses`` who stated the cameras. ``mask`` is
    the picture of the thing's outline that was given with one photo, ``box_px`` its stated box there: left, top, right, bottom.
    """

    kind: Literal["image", "photos", "text", "mesh"]
    file: FileBelow
    sha256: str
    prompt: str | None = None
    variation: int = 0
    turns_deg: list[float] | None = None
    poses: StatedCameras | None = None
    mask: FileBelow | None = None
    box_px: list[float] | None = None
    license: str
    attribution: str | None = None


class StageProvenance(Record):
    """The code and the backend that did a stage; ``rehearsal``: a rehearsal server (``manitwin fake``) answered in its place."""

    version: str
    backend: str
    model: str | None = None
    rehearsal: bool = False


class Provenance(Record):
    """The version, configuration, seed and stages that made the twin, and the digest of what people have put right of it."""

    manitwin_version: str
    config_sha256: str
    seed: int
    stages: dict[str, StageProvenance]
    amendments_sha256: str | None = None

    @property
    def rehearsed(self) -> tuple[str, ...]:
        """The stages whose backend was a rehearsal server, sorted."""
        return tuple(sorted(name for name, stage in self.stages.items() if stage.rehearsal))


class Likely(Record):
    """What a thing may be, and how likely that is."""

    name: str
    probability: Unit


class Naming(Record):
    """What a classifier takes a thing for that nobody has named: ``name`` is None where no guess was likely enough.

    ``probability`` is that of ``name``, or of the likeliest guess; its interval is that of the single pictures.
    """

    name: str | None
    probability: Estimate
    likeliest: list[Likely]


class Hulls(Record):
    """The convex collision hulls, measured against the surface they stand for."""

    count: int
    max_vertices: int
    volume_ratio: float
    surface_error_p95_m: float
    surface_uncovered_max_m: float
    keeps_opening: bool | None
    cavity_kept: float | None = None


class MeshReport(Record):
    """The geometry, and what repair did to it."""

    vertices: int
    faces: int
    watertight: bool
    components: int
    euler_number: int
    volume_m3: Finite
    area_m2: Finite
    repairs: list[str]
    hulls: Hulls


class OrientedBox(Record):
    """The oriented bounding box: its full extents and its pose in the object frame."""

    extents_m: Vector3
    obb_to_object: Matrix4


class Physical(Record):
    """Size, mass and contact properties; ``filling``: of a closed vessel, which weighs what it holds."""

    extents_m: Vector3
    obb: OrientedBox
    scale_applied: Finite
    material: str
    mass_kg: Estimate
    friction_static: Estimate
    friction_dynamic: Estimate
    restitution: Estimate
    density_kg_m3: Finite
    center_of_mass_m: Vector3
    center_of_mass_uncertainty_m: Finite
    inertia_kg_m2: Matrix3
    mass_distribution: Literal["solid", "shell", "parts", "annotated"]
    filling: Filling | None = None

    @model_validator(mode="after")
    def _possible(self) -> Physical:
        """Refuse what no object has: no simulator is given a negative mass, or a metre count that overflows."""
        for name, estimate, largest in (
            ("mass_kg", self.mass_kg, LARGEST_KG),
            ("friction_static", self.friction_static, LARGEST_M),
            ("friction_dynamic", self.friction_dynamic, LARGEST_M),
            ("restitution", self.restitution, 1.0),
        ):
            if estimate.low < 0 or estimate.value > largest or (name == "mass_kg" and estimate.value == 0):
                raise ValueError(f"{name} is {estimate.value:g}, which no object has")
        if not all(0 <= side <= LARGEST_M for side in self.extents_m):
            raise ValueError(f"extents_m are {self.extents_m}, which no object has")
        if not all(abs(place) <= LARGEST_M for place in self.center_of_mass_m):
            raise ValueError(f"center_of_mass_m is {self.center_of_mass_m}, which no object has")
        if not all(abs(moment) <= LARGEST_KG * LARGEST_M for row in self.inertia_kg_m2 for moment in row):
            raise ValueError("inertia_kg_m2 is larger than that of any object")
        return self

    @property
    def longest_m(self) -> float:
        """The longest side of the oriented box: a turn of the thing in its frame changes nothing, as it does of ``extents_m``."""
        return max(self.obb.extents_m)


class Language(Record):
    """Words: the paper's six attributes, a sentence, and more sentences."""

    category: str = Field(min_length=1)
    color: str = Field(min_length=1)
    material: str = Field(min_length=1)
    size: str = Field(min_length=1)
    shape: str = Field(min_length=1)
    function: str = Field(min_length=1)
    caption: str = Field(min_length=1)
    captions: list[str]


class Placement(Record):
    """A stable pose: ``object_to_plane``, the plane being z = 0."""

    position_m: Vector3
    quaternion_wxyz: Quaternion
    probability: Unit
    upright: bool
    settled: bool
    collision_radius_m: Finite


class Quality(Record):
    """Findings: shown, counted, filterable, not rejecting."""

    checks: list[Check]


class TwinRecord(Record):
    """twin.json: everything that a person wants to read about a twin.

    ``parts`` is empty where geometry tells none, and of twins of schema version 1. ``links`` and ``joints`` are those of what
    moves in itself, empty for all others and before schema version 4.
    """

    schema_version: int = SCHEMA_VERSION
    twin_id: FolderName
    revision: str
    files: dict[FileBelow, str]
    name: str | None
    naming: Naming | None = None
    status: Status
    rejection: Rejection | None
    source: Source
    provenance: Provenance
    mesh: MeshReport | None = None
    physical: Physical | None = None
    language: Language | None = None
    points: Points | None = None
    parts: list[Part] = Field(default_factory=list, max_length=NO_PART)
    links: list[Link] = Field(default_factory=list, max_length=MAX_LINKS)
    joints: list[Joint] = Field(default_factory=list)
    grasps: GraspSummary | None = None
    placements: list[Placement] | None = None
    quality: Quality

    @model_validator(mode="after")
    def _whole(self) -> TwinRecord:
        if (self.status == "rejected") != (self.rejection is not None):
            raise ValueError("a rejected twin has a rejection, an accepted one has none")
        missing = [
            n for n in ("mesh", "physical", "language", "points", "grasps", "placements") if getattr(self, n) is None
        ]
        if self.status == "accepted" and missing:
            raise ValueError(f"an accepted twin lacks {', '.join(missing)}")
        if bool(self.parts) != (FACE_PARTS in self.files):
            raise ValueError(f"a twin with parts has the file {FACE_PARTS}, one without has none")
        if [part.id for part in self.parts] != [f"p{place}" for place in range(len(self.parts))]:
            raise ValueError("parts are called p0, p1 ... in their order")
        if bool(self.links) != (FACE_LINKS in self.files) or len(self.links) == 1:
            raise ValueError(f"a twin with links has two or more and the file {FACE_LINKS}, one without has none")
        require_tree([link.name for link in self.links], self.joints)
        return self
