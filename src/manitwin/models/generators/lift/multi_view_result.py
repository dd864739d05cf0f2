"""Result of a generation from several photos of one object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import trimesh

from manitwin.models.generators.lift.carved_part import carved_part, seen_area_share, select_colour_photos
from manitwin.models.generators.lift.carved_solid import CarvedSolid
from manitwin.twin.import_record import ImportRecord


@dataclass(frozen=True)
class MultiViewResult:
    """A mesh ``part`` in the object frame, notes, the share of its area that no photo shows, and what a template knows of it.

    ``metric``: the mesh is in metres; otherwise its longest side is 1.
    """

    part: trimesh.Trimesh
    notes: dict[str, Any]
    unseen_share: float
    known: ImportRecord | None = None
    metric: bool = False


def carved_result(carved: CarvedSolid, source: str) -> MultiViewResult:
    """Return a carved solid as a mesh, with notes on each photo: covered share of its silhouette, use of its colours."""
    shown = {id(photo) for photo in select_colour_photos(carved)}
    notes = {
        "primitive": "visual hull",
        "source": source,
        "rests": "standing",
        "confidence": min(carved.covered_shares),
        "camera": carved.camera,
        "left_out": list(carved.left_out),
        "views": [
            {
                "name": photo.name,
                "turn_deg": photo.turn_deg,
                "turn_stated": True,
                "covered": share,
                "colours": id(photo) in shown,
            }
            for share, photo in zip(carved.covered_shares, carved.photos, strict=True)
        ],
    }
    return MultiViewResult(carved_part(carved), notes, 1.0 - seen_area_share(carved))
