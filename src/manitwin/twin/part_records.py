"""Parts of a twin: named regions of its visual surface, and the file that assigns each face to a part."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manitwin.twin.record_values import Finite, Record, Unit, Vector3

FACE_PARTS = "face_parts.npy"
"""One ``uint8`` per face of visual.glb, in the order of ``formats.glb.read_glb``: the index of its part."""
NO_PART = 255
"""Label of faces that belong to no part."""


class Part(Record):
    """A named region of the visual surface, such as handle or cap.

    ``source``: ``template:<category>`` for parts known by construction, ``geometry:<rule>`` for parts found by shape. ``faces``
    is the number of faces in visual.glb, ``area_share`` the share of the surface area, ``centroid_m`` the area centroid in the
    object frame.
    """

    id: str
    name: str = Field(min_length=1)
    source: str = Field(min_length=1)
    confidence: Unit
    faces: Annotated[int, Field(ge=1)]
    area_share: Annotated[Finite, Field(gt=0, le=1)]
    centroid_m: Vector3
