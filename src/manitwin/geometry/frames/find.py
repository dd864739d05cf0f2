"""Selection of the functional frame for a point and its label."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.frames.axis import axis_frame
from manitwin.geometry.frames.edge import edge_frame
from manitwin.geometry.frames.face import button_frame, face_frame, surface_frame
from manitwin.geometry.frames.feature import FeatureFrame, Found, FramedMesh, Kind, NoFrame
from manitwin.geometry.frames.hole import hole_frame
from manitwin.geometry.frames.label_keywords import (
    face_direction_for_label,
    frame_kinds_for_label,
    is_end_face_label,
    is_pouring_label,
    may_project_sideways,
)
from manitwin.geometry.frames.opening import opening_frame
from manitwin.geometry.frames.tip import tip_frame


def find_frame(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray, label: str) -> Found:
    """Return the frame of the feature at a surface point with outward normal ``(3,)``, of a kind that fits its label.

    The fitting kinds are tried in order. If none is clear, the reasons of the first two are returned: a feature's frame is
    never replaced by that of another feature.
    """
    reasons = []
    for kind in frame_kinds_for_label(label):
        found = _frame_of_kind(surface, point_m, normal, label, kind)
        if isinstance(found, FeatureFrame):
            if kind == "tip" and may_project_sideways(label) and _flat_aside(surface, point_m, normal, found):
                return NoFrame("tip: the end and the flat place beside it look different ways")
            return found
        reasons.append(f"{kind}: {found.reason}")
    return NoFrame("; ".join(reasons[:2]))


_SAME_WAY = np.cos(np.radians(25.0))


def _flat_aside(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray, tip: FeatureFrame) -> bool:
    face = face_frame(surface, point_m, normal)
    return isinstance(face, FeatureFrame) and float(face.z @ tip.z) < _SAME_WAY


def _frame_of_kind(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray, label: str, kind: Kind) -> Found:
    if kind == "face":
        return face_frame(surface, point_m, normal, face_direction_for_label(label), is_end_face_label(label))
    if kind == "opening":
        return opening_frame(surface, point_m)
    if kind == "hole":
        return hole_frame(surface, point_m, normal, through=frame_kinds_for_label(label)[0] != "hole")
    if kind == "tip":
        return tip_frame(surface, point_m, normal, is_pouring_label(label))
    return _BY_PLACE[kind](surface, point_m, normal)


_BY_PLACE = {
    "edge": edge_frame,
    "axis": axis_frame,
    "button": button_frame,
    "surface": surface_frame,
}
