"""Functional frames of the chosen points, computed from geometry if an import record does not state them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manitwin.geometry.frames.feature import FeatureFrame, FramedMesh
from manitwin.geometry.frames.feature_deviation import ON_FEATURE_M, feature_deviation_m
from manitwin.geometry.frames.find import find_frame
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.twin.point_records import FunctionalFrame, FunctionalPoint

GEOMETRY = "geometry"
"""The source of a computed frame."""


def with_frames(points: Sequence[FunctionalPoint], surface: FramedMesh) -> tuple[list[FunctionalPoint], list[str]]:
    """Return the points with the frames of their features, and the reasons for those without one.

    The point and its label select the feature, geometry determines the frame. ``surface`` is the watertight mesh in the object
    frame. A frame that a point already has is kept.
    """
    framed, missing = [], []
    for point in points:
        if point.frame is None:
            found = find_frame(surface, np.array(point.position_m), np.array(point.normal), point.label)
            if isinstance(found, FeatureFrame):
                off_m = feature_deviation_m(
                    found.kind, found.position_m, found.rotation, found.size_m, surface.samples[0], surface.mesh
                )
                if off_m <= max(ON_FEATURE_M, surface.spacing_m):
                    point = point.model_copy(update={"frame": _recorded(found)})
                else:
                    missing.append(f"{point.id}, {point.label!r}: its {found.kind} is off the surface")
            else:
                missing.append(f"{point.id}, {point.label!r}: {found.reason}")
        framed.append(point)
    return framed, missing


def _recorded(frame: FeatureFrame) -> FunctionalFrame:
    return FunctionalFrame(
        position_m=frame.position_m.tolist(),
        quaternion_wxyz=quaternion_wxyz(frame.rotation).tolist(),
        kind=frame.kind,
        size_m=frame.size_m,
        free="roll" if frame.roll_free else "none",
        source=GEOMETRY,
    )
