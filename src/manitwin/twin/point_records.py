"""Points of a twin: candidates, functional points with frames, and grasp points. Object frame, metres, quaternions wxyz."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from manitwin.twin.record_values import Finite, Quaternion, Record, Unit, Vector3

GraspType = Literal["parallel_jaw", "pinch", "power", "three_finger", "enveloping"]  # the paper's five
FrameKind = Literal["opening", "face", "tip", "edge", "hole", "axis", "button", "surface"]
"""The kind of feature that a functional frame describes."""
# Tolerated error of a quaternion's length: our frames have full precision, those of other tools often four digits
_UNIT_TOLERANCE = 1e-3


class RefinedCandidate(Record):
    """A candidate that was moved by a second, closer look, with its position and normal in the marked views."""

    candidate: int
    marked_position_m: Vector3
    marked_normal: Vector3


class Candidates(Record):
    """The points among which functional and grasp points are chosen (paper: 42).

    ``refined`` lists the candidates that were moved after the views were marked, each at most once.
    """

    positions_m: list[Vector3]
    normals: list[Vector3]
    refined: list[RefinedCandidate] = Field(default_factory=list)


class FunctionalFrame(Record):
    """A functional frame in the object frame: the functional point selects a feature, and the frame is the feature's own.

    Z is the functional direction: out of an opening, face, button or surface; along a tip, or the line of a hole or axis; away
    from an edge. X is the secondary direction: the pour direction of an opening, the line of an edge, from a hole to the centre
    of mass. ``size_m`` is a radius: of the circle with the area of an opening's rim, of a face, of a button or of a surface's
    flat part; of the inscribed circle of a hole; of a tip's end. For an edge or an axis it is the length. ``free`` is ``roll``
    if X is arbitrary. ``source``: geometry | template:<category>, followed by remarks.
    """

    position_m: Vector3
    quaternion_wxyz: Quaternion
    kind: FrameKind
    size_m: Annotated[Finite, Field(gt=0)]
    free: Literal["none", "roll"]
    source: str = Field(min_length=1)

    @model_validator(mode="after")
    def _check_quaternion(self) -> FunctionalFrame:
        length = sum(value * value for value in self.quaternion_wxyz) ** 0.5
        if abs(length - 1) > _UNIT_TOLERANCE:
            raise ValueError(f"quaternion_wxyz has length {length:g}, that of a rotation has 1")
        return self

    def scaled(self, factor: float) -> FunctionalFrame:
        """Return the frame scaled by ``factor``."""
        position = (factor * np.array(self.position_m)).tolist()
        return self.model_copy(update={"position_m": position, "size_m": factor * self.size_m})


class FunctionalPoint(Record):
    """A point with a specific function; ``frame`` is None if it cannot be determined reliably from geometry.

    ``source``: human:<annotator> if a person has moved the point; None if it is from the annotator in the provenance.
    """

    id: str
    candidate: int
    position_m: Vector3
    normal: Vector3
    label: str
    description: str
    confidence: Unit
    rationale: str
    frame: FunctionalFrame | None = None
    source: str | None = None


class GraspPoint(Record):
    """A point suited to grasping; ``label`` is the part as named by the annotator, None if not named.

    ``verified`` counts the first gripper's successful grasps that touch this point's part within the association radius; None:
    not counted. ``shortfall`` states why there are fewer than requested, empty if there are not. ``source``: as of a functional
    point.
    """

    id: str
    candidate: int
    position_m: Vector3
    normal: Vector3
    type: GraspType
    scenario: str
    confidence: Unit
    rationale: str
    label: str | None = None
    verified: int | None = Field(default=None, ge=0)
    shortfall: str = ""
    source: str | None = None


class Points(Record):
    """Candidate, functional and grasp points.

    ``withdrawn`` are grasp points at which no grasp succeeded and which were replaced by others.
    """

    candidates: Candidates
    functional: list[FunctionalPoint]
    grasp: list[GraspPoint]
    withdrawn: list[GraspPoint] = Field(default_factory=list)
