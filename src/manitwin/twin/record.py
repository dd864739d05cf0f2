"""The schema of twin.json, the record of a finished twin.

SI units; object frame (right-handed, +Z up, origin at the bottom centre); quaternions wxyz.
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

_OF_EVERY_STAGE = frozenset({"too_large"})  # every stage has a memory limit
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
    """The reason why an input was rejected."""

    stage: str
    reason: str
    detail: str

    @model_validator(mode="after")
    def _check_reason(self) -> Rejection:
        if self.reason not in REJECTION_REASONS.get(self.stage, frozenset()):
            raise ValueError(f"stage {self.stage!r} has no rejection reason {self.reason!r}")
        return self


class StatedCameras(Record):
    """The file that stated the camera poses of several photos; it is archived as ``transforms.json`` with z up.

    ``format``: transforms.json | colmap. ``up`` and ``unit`` are the file's up axis and length unit, with the source of that
    information. ``unit_m`` is the unit in metres; None if unknown, in which case the object's size is not measured.
    """

    file: str
    format: str
    up: str
    roll_deg: Finite
    unit: str
    unit_m: Finite | None


class Source(Record):
    """The input of the twin; ``variation`` numbers the objects made from one text.

    ``photos``: several photos of one object, in order in the archive ``file``. ``turns_deg`` is the camera's rotation about the
    vertical for each, counter-clockwise seen from above, if stated; ``poses`` the source of stated camera poses. ``mask`` is
    the mask image given with a single photo, ``box_px`` the stated bounding box in it: left, top, right, bottom.
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
    """The code version and backend of a stage; ``rehearsal``: a rehearsal server (``manitwin fake``) answered instead of a
    model.
    """

    version: str
    backend: str
    model: str | None = None
    rehearsal: bool = False


class Provenance(Record):
    """The version, configuration, seed and stages that made the twin, and the digest of its manual corrections."""

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
    """A possible name of an object with its probability."""

    name: str
    probability: Unit


class Naming(Record):
    """A classifier's name for an unnamed object; ``name`` is None if no guess is likely enough.

    ``probability`` is that of ``name``, or of the likeliest guess; its interval spans the single images.
    """

    name: str | None
    probability: Estimate
    likeliest: list[Likely]


class Hulls(Record):
    """The convex collision hulls and their measured error against the surface."""

    count: int
    max_vertices: int
    volume_ratio: float
    surface_error_p95_m: float
    surface_uncovered_max_m: float
    keeps_opening: bool | None
    cavity_kept: float | None = None


class MeshReport(Record):
    """Mesh statistics, and the repairs made."""

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
    """Size, mass and contact properties; ``filling``: fill states of a closed vessel."""

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
    def _check_plausible(self) -> Physical:
        """Reject impossible values, such as negative masses or lengths that overflow in a simulator."""
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
        """The longest side of the oriented box, which unlike ``extents_m`` does not depend on the object's rotation in its
        frame.
        """
        return max(self.obb.extents_m)


class Language(Record):
    """Descriptions: the paper's six attributes, a caption, and further captions."""

    category: str = Field(min_length=1)
    color: str = Field(min_length=1)
    material: str = Field(min_length=1)
    size: str = Field(min_length=1)
    shape: str = Field(min_length=1)
    function: str = Field(min_length=1)
    caption: str = Field(min_length=1)
    captions: list[str]


class Placement(Record):
    """A stable pose ``object_to_plane``, with the plane at z = 0."""

    position_m: Vector3
    quaternion_wxyz: Quaternion
    probability: Unit
    upright: bool
    settled: bool
    collision_radius_m: Finite


class Quality(Record):
    """Quality checks, which are reported and can be filtered by, but do not reject."""

    checks: list[Check]


class TwinRecord(Record):
    """twin.json: the complete record of a twin.

    ``parts`` is empty if no parts were found, and for twins of schema version 1. ``links`` and ``joints`` are those of
    articulated objects, empty for rigid ones and before schema version 4.
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
    def _check_consistent(self) -> TwinRecord:
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
