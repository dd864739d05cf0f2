"""From several photo files of one object to a carved solid: each cut out as a build cuts it out, then carved."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from manitwin.config import MattingConfig
from manitwin.errors import UsageError
from manitwin.models.generators.lift.carved_solid import Carved
from manitwin.models.generators.lift.carving import are_crossing, carve, power_of
from manitwin.models.generators.lift.hint import hint_from_name
from manitwin.models.generators.protocol import MOST_PHOTOS
from manitwin.pipeline.photo import PhotoStage, refused
from manitwin.pipeline.photo_groups import copies_told, given_twice

EXAMPLE = "such as --turns 0,90,180"


def carve_photos(
    paths: Sequence[Path], turns_deg: Sequence[float], name: str | None = None
) -> tuple[Carved, list[str]]:
    """Carve what photos show from stated turns (degrees about the vertical, counter-clockwise seen from above, the first 0).

    Returns also what was found of each photo while it was read and cut out. Raises UsageError for a photo that is given twice
    and for turns that are not one a photo or all in one direction, InputError for a file that cannot be read, Rejected naming
    the photo that cannot be matted or does not go with the others.
    """
    if not 2 <= len(paths) <= MOST_PHOTOS or len(turns_deg) != len(paths):
        raise UsageError(
            f"photos: {len(paths)}, turns: {len(turns_deg)}; give 2 to {MOST_PHOTOS} photos and a turn of each, {EXAMPLE}"
        )
    twice = given_twice([str(path.resolve()) for path in paths])
    if twice is not None:
        raise UsageError(f"{Path(twice).name} is given twice; give each photo once")
    if not np.isfinite(turns_deg).all():
        raise UsageError(f"a turn is no number; give degrees, {EXAMPLE}")
    if not are_crossing(turns_deg):
        raise UsageError(
            "all photos are from one direction or its opposite: give one from the side, such as 90 degrees"
        )
    stage = PhotoStage(MattingConfig())
    photos, lenses, findings = [], set(), copies_told([str(path) for path in paths])
    for path in paths:
        rgba, field = stage.cut_out(path, name, refused)
        photos.append((path.name, rgba))
        lenses.add(field["focal_mm"])
        findings += [f"{path.name}: {finding}" for finding in field["findings"]]
    focal_mm = lenses.pop() if len(lenses) == 1 else None
    carved = carve(photos, turns_deg, power=power_of(hint_from_name(name)), focal_mm=focal_mm)
    findings += [
        f"{left}: left out, its outline does not go with those of the other photos" for left in carved.left_out
    ]
    return carved, findings
