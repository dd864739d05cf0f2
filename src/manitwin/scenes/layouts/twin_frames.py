"""Functional frames of a twin for skills: labelled poses in the object frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel

from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.twin.point_records import FrameKind, FunctionalFrame


@dataclass(frozen=True)
class TwinFrame:
    """A functional point's frame: ``frame_to_object (4, 4)``, Z the functional direction; ``size_m`` as in the record."""

    label: str
    kind: FrameKind
    frame_to_object: np.ndarray
    size_m: float
    roll_free: bool


class LabelledPoint(BaseModel):
    """The fields of a functional point that a pool reads."""

    label: str
    frame: FunctionalFrame | None = None


def twin_frames(points: Iterable[LabelledPoint]) -> tuple[TwinFrame, ...]:
    """Return the frames of the points that have one, in order."""
    return tuple(
        TwinFrame(
            point.label,
            frame.kind,
            transform(rotation_from_quaternion_wxyz(np.array(frame.quaternion_wxyz)), np.array(frame.position_m)),
            frame.size_m,
            frame.free == "roll",
        )
        for point in points
        if (frame := point.frame) is not None
    )
