"""The twin's points: candidates, functional points with their frames, grasp points. Object frame, metres, quaternions wxyz."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from manitwin.twin.record_values import Finite, Quaternion, Record, Unit, Vector3

GraspType = Literal["parallel_jaw", "pinch", "power", "three_finger", "enveloping"]  # the paper's five
FrameKind = Literal["opening", "face", "tip", "edge", "hole", "axis", "button", "surface"]
"""What a functional frame is the frame of."""
_UNIT_TOLERANCE = 1e-3  # of a quaternion's length: frames are written in full precision, other tools' with four digits


class RefinedCandidate(Record):
    """A candidate that moved to the place that a second, closer look found: where it was when the views were marked."""

    candidate: int
    marked_position_m: Vector3
    marked_normal: Vector3


class Candidates(Record):
    """The points among which functional and grasp points are chosen (the paper: 42).

    ``refined`` names those that a closer look has moved since the views were marked, each at most once.
    """

    positions_m: list[Vector3]
    normals: list[Vector3]
    refined: list[RefinedCandidate] = Field(default_factory=list)


class FunctionalFrame(Record):
    """Where a function truly is, as a frame in the object frame: the point chooses the feature, the frame is the feature's.

    Z is the functional direction: out of an opening, face, button or surface, along a tip, a hole's or an axis's line, away
    from an edge. X is the second one: the pour direction of an opening, the line of an edge, from a hole to the centre of mass.
    ``size_m`` is a radius, of the circle with the area of an opening's rim, a face, a button or a surface's flat part, of the
    circle inscribed in a hole, of a tip's end; of an edge or an axis it is the length. ``free`` is ``roll`` where X is one
    choice of many. ``source``: geometry | template:<category> and what else is said of it.
    """

    position_m: Vector3
    quaternion_wxyz: Quaternion
    kind: FrameKind
    size_m: Annotated[Finite, Field(gt=0)]
    free: Literal["none", "roll"]
    source: str = Field(min_length=1)

    @model_validator(mode="after")
    def _is_a_rotation(self) -> FunctionalFrame:
        length = sum(value * value for value in self.quaternion_wxyz) ** 0.5
        if abs(length - 1) > _UNIT_TOLERANCE:
            raise ValueError(f"quaternion_wxyz has length {length:g}, that of a rotation has 1")
        return self

    def scaled(self, factor: float) -> FunctionalFrame:
        """Return the frame of the thing at another size."""
        position = (factor * np.array(self.position_m)).tolist()
        return self.model_copy(update={"position_m": position, "size_m": factor * self.size_m})


class FunctionalPoint(Record):
    """A point with a specific function; ``frame`` is None where geometry does not tell it reliably.

    ``source``: human:<annotator> where a person has moved it, else None: it is the annotator's of the provenance.
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
    """A point that is good to hold the object by; ``label`` is the part as whoever chose it says, None where nobody did.

    ``verified`` counts the first gripper's grasps that held and touch this point's part within the radius of
    association; None: not counted. ``shortfall`` says why they are fewer than were asked for; empty where they are not.
    ``source`` as that of a functional point.
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

    ``withdrawn`` are grasp points at which no grasp held, and in whose place another one is.
    """

    candidates: Candidates
    functional: list[FunctionalPoint]
    grasp: list[GraspPoint]
    withdrawn: list[GraspPoint] = Field(default_factory=list)
