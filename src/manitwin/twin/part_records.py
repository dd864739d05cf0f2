"""The twin's parts: named regions of its visual surface, and the file that says of each face which one it is of."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manitwin.twin.record_values import Finite, Record, Unit, Vector3

FACE_PARTS = "face_parts.npy"
"""One ``uint8`` a face of visual.glb, in the order of ``formats.glb.read_glb``: the part's place in the table."""
NO_PART = 255
"""The face is of no part that geometry tells."""


class Part(Record):
    """A region of the visual surface that has a name, such as handle or cap.

    ``source``: ``template:<category>`` where the parts are known by construction, ``geometry:<rule>`` where they were told by
    shape. ``faces`` of visual.glb are of it, ``area_share`` of the surface; ``centroid_m`` is theirs, by area, object frame.
    """

    id: str
    name: str = Field(min_length=1)
    source: str = Field(min_length=1)
    confidence: Unit
    faces: Annotated[int, Field(ge=1)]
    area_share: Annotated[Finite, Field(gt=0, le=1)]
    centroid_m: Vector3
