"""The twin's schema: the one copy in code of what a finished twin says about itself.

SI units, object frame (right-handed, +Z up, origin at the bottom centre), quaternions wxyz.
"""

from __future__ import annotations

import math
import re
from pathlib import PurePosixPath
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

SCHEMA_VERSION = 1

Status = Literal["accepted", "rejected"]
GraspType = Literal["parallel_jaw", "pinch", "power", "three_finger", "enveloping"]  # the paper's five
Outcome = Literal["held", "collides", "unreachable", "misses", "penetrates", "drops", "unstable", "slips"]

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


def _finite(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError("not a finite number")
    return value


CONTROLS = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff]")
"""What no text of a record holds: XML, which many exports are, has no control characters, and UTF-8 no lone surrogates."""
LARGEST_M, LARGEST_KG = 1e4, 1e6
"""Far beyond what a gripper meets, and no trouble for the arithmetic of any simulator."""


def _file_below(name: str) -> str:
    parts = PurePosixPath(name).parts
    if not parts or name.startswith("/") or ".." in parts or not name.isprintable():
        raise ValueError(f"{name[:80]!r} is no file below the twin's folder")
    return name


def _folder_name(name: str) -> str:
    if name.startswith(".") or "/" in _file_below(name):
        raise ValueError(f"{name[:80]!r} is no name for a folder")
    return name


FileBelow = Annotated[str, AfterValidator(_file_below)]
FolderName = Annotated[str, AfterValidator(_folder_name)]
Finite = Annotated[float, AfterValidator(_finite)]
Vector3 = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Quaternion = Annotated[list[Finite], Field(min_length=4, max_length=4)]
Matrix3 = Annotated[list[Vector3], Field(min_length=3, max_length=3)]
Matrix4 = Annotated[list[Quaternion], Field(min_length=4, max_length=4)]
Unit = Annotated[float, Field(ge=0, le=1)]


class Record(BaseModel):
    """A part of the schema: unknown keys are errors, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Estimate(Record):
    """A number with its interval and who said so.

    ``source``: measured | user | vlm:<model> | prior:<category> | density*volume | imported:<format> | default. What was
    imported is another tool's word: it is held against the same plausibility as an estimate.
    """

    value: Finite
    low: Finite
    high: Finite
    source: str = Field(min_length=1)

    @model_validator(mode="after")
    def _ordered(self) -> Estimate:
        if not self.low <= self.value <= self.high:
            raise ValueError(f"{self.value} is outside [{self.low}, {self.high}]")
        return self


class Check(Record):
    """One quality check: ``passed`` is None where nothing could judge it."""

    name: str
    passed: bool | None
    value: float | str | None = None
    limit: float | str | None = None
    message: str = ""


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


class Source(Record):
    """The input that the twin was made of."""

    kind: Literal["image", "text", "mesh"]
    file: FileBelow
    sha256: str
    prompt: str | None = None
    license: str
    attribution: str | None = None


class StageProvenance(Record):
    """The code and the backend that did a stage; ``rehearsal``: a rehearsal server (``manitwin fake``) answered in its place."""

    version: str
    backend: str
    model: str | None = None
    rehearsal: bool = False


class Provenance(Record):
    """The version, configuration, seed and stages that made the twin."""

    manitwin_version: str
    config_sha256: str
    seed: int
    stages: dict[str, StageProvenance]

    @property
    def rehearsed(self) -> tuple[str, ...]:
        """The stages whose backend was a rehearsal server, sorted."""
        return tuple(sorted(name for name, stage in self.stages.items() if stage.rehearsal))


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
    """Size, mass and contact properties."""

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
    mass_distribution: Literal["solid", "shell"]

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


class Candidates(Record):
    """The points among which functional and grasp points are chosen (the paper: 42)."""

    positions_m: list[Vector3]
    normals: list[Vector3]


class FunctionalPoint(Record):
    """A point with a specific function."""

    id: str
    candidate: int
    position_m: Vector3
    normal: Vector3
    label: str
    description: str
    confidence: Unit
    rationale: str


class GraspPoint(Record):
    """A point that is good to hold the object by."""

    id: str
    candidate: int
    position_m: Vector3
    normal: Vector3
    type: GraspType
    scenario: str
    confidence: Unit
    rationale: str


class Points(Record):
    """Candidate, functional and grasp points."""

    candidates: Candidates
    functional: list[FunctionalPoint]
    grasp: list[GraspPoint]


class Trial(Record):
    """The settings of the grasp trial: a success rate means nothing without them."""

    engine: str
    finger_friction: Finite
    object_friction: Finite
    combine: str
    force_n: Finite
    timestep_s: Finite
    solver_iterations: int
    max_steps: int
    stable_frames: int
    max_displacement_m: Finite
    slide_distance_m: Finite


class SecondOpinion(Record):
    """The agreement of a second engine: over grasps that held, some that failed, and jittered controls of those that held.

    Kappa is Cohen's over the jittered alone: among grasps that nearly all hold, agreement says little.
    """

    engine: str
    held_tried: int
    holds_share: Unit | None
    failed_tried: int
    failed_pass_share: Unit | None
    jittered: int
    jittered_held: int
    jittered_hold_in_second_engine: int
    jittered_agree: int
    kappa: Finite | None


class RobustnessSummary(Record):
    """The perturbed trials of the held grasps, and how many survive.

    ``median`` is that of the grasps' shares; ``robust`` counts those that rather hold in ``robust_share`` of the cases than
    in ``fragile_share`` (the sequential test's verdict).
    """

    pose_m: Finite
    pose_deg: Finite
    friction: tuple[Finite, Finite]
    force: tuple[Finite, Finite]
    mass_kg: tuple[Finite, Finite]
    center_of_mass_m: Finite
    max_trials: int
    trials: int
    median: Unit | None
    robust: int
    robust_share: Unit
    fragile_share: Unit


class FailureTable(Record):
    """Outcomes counted by what was grasped: by the type of the nearest grasp point and by the nearest functional point."""

    by_grasp_type: dict[str, dict[str, int]]
    by_region: dict[str, dict[str, int]]


class GraspSummary(Record):
    """The outcomes of the grasps of one gripper."""

    gripper: str
    gripper_sha256: str
    proposed: int
    proposed_by_filter: dict[str, int]
    simulated: int
    verified: int
    success_rate: Unit
    unfiltered_simulated: int
    unfiltered_success_rate: Unit | None
    failures: dict[str, int]
    approach_octants: int
    file: str
    association_radius_m: Finite
    association_radius_widened: bool
    share_beyond_3cm: Unit
    trial: Trial
    failure_table: FailureTable
    second_opinion: SecondOpinion | None
    robustness: RobustnessSummary | None
    other_grippers: dict[str, OtherGripper] = Field(default_factory=dict)


class OtherGripper(Record):
    """The outcomes of the grasps of another gripper: a summary, or the reason for none; and what it can hold of the first's.

    ``transferred`` counts the grasp points by which the first gripper holds the object and this one does too, of
    ``transferable``.
    """

    summary: GraspSummary | None
    reason: str | None
    detail: str | None
    transferable: int
    transferred: int


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
    """twin.json: everything that a person wants to read about a twin."""

    schema_version: int = SCHEMA_VERSION
    twin_id: FolderName
    revision: str
    files: dict[FileBelow, str]
    name: str | None
    status: Status
    rejection: Rejection | None
    source: Source
    provenance: Provenance
    mesh: MeshReport | None = None
    physical: Physical | None = None
    language: Language | None = None
    points: Points | None = None
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
        return self
