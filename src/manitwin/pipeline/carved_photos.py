"""Carving of a solid from several photo files of one object, which are cut out as in a build."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from manitwin.config import MattingConfig
from manitwin.errors import InputError, Rejected, UsageError
from manitwin.models.generators.lift.carved_part import carved_part
from manitwin.models.generators.lift.carved_solid import CarvedSolid
from manitwin.models.generators.lift.carving import are_crossing, carve, superellipse_power
from manitwin.models.generators.lift.hint import hint_from_name
from manitwin.models.generators.lift.posed_carving import carve_posed
from manitwin.models.generators.lift.posed_views import scaled_part
from manitwin.pipeline.photo import PhotoStage, reject_doubted
from manitwin.pipeline.photo_groups import distinct_names, first_duplicate, identical_file_messages
from manitwin.pipeline.photo_thinning import MOST_GIVEN, select_photos, thinned_words
from manitwin.pipeline.stated_poses import StatedPoses, stated_poses

EXAMPLE = "such as --turns 0,90,180"


@dataclass(frozen=True)
class CarvedPhotos:
    """A carved solid, its textured ``part`` in the object frame, and findings about the photos.

    ``metric``: the part is in metres, from the unit of the stated poses; otherwise its longest side is 1.
    """

    carved: CarvedSolid
    part: trimesh.Trimesh
    findings: list[str]
    metric: bool = False


@dataclass(frozen=True)
class _CutOut:
    """The photos that could be cut out, by their numbers, and the focal lengths stated in them."""

    photos: dict[int, tuple[str, np.ndarray]]
    focals_mm: list[float | None]
    findings: list[str]


def carve_photos(
    paths: Sequence[Path],
    turns_deg: Sequence[float] | None,
    name: str | None = None,
    *,
    poses: Path | None = None,
    up: str = "auto",
    units: str = "auto",
) -> CarvedPhotos:
    """Carve a solid from photos at stated turns (degrees about the vertical, counter-clockwise seen from above, the first 0).

    Alternatively ``poses`` is a file with the camera poses; ``up`` and ``units`` describe it. A photo that cannot be cut out is
    left out, with a finding. Raises UsageError for a photo given twice, for turns that do not match the photos or all have one
    direction, and for poses that do not match the photos; InputError for an unreadable file; Rejected if fewer than two photos
    can be cut out, or naming a photo that is inconsistent with the others.
    """
    _check(paths, turns_deg, poses)
    given = len(paths)
    paths, turns_deg = _thinned(paths, turns_deg, poses)
    stated = None if poses is None else _stated(paths, poses, up, units)
    masks = [None] * len(paths) if stated is None else [camera.mask for camera in stated.cameras]
    cut = _cut_out(paths, name, masks)
    if len(paths) < given:
        cut.findings.insert(0, thinned_words(len(paths), given))
    turns = list(turns_deg or ()) if stated is None else list(stated.turns_deg)
    photos, turns = list(cut.photos.values()), [turns[number] for number in cut.photos]
    if stated is not None:
        return _posed(photos, [*cut.photos], turns, stated, cut.findings)
    if not are_crossing(turns):
        raise Rejected(
            "generator_failed",
            f"{'; '.join([*cut.findings, ''])}the remaining photos are all from one direction or its opposite; add"
            f" one from the side",
            "generate",
        )
    lenses = set(cut.focals_mm)
    focal_mm = lenses.pop() if len(lenses) == 1 else None
    carved = carve(photos, turns, power=superellipse_power(hint_from_name(name)), focal_mm=focal_mm)
    return CarvedPhotos(carved, carved_part(carved), [*cut.findings, *_left_out(carved)])


def _check(paths: Sequence[Path], turns_deg: Sequence[float] | None, poses: Path | None) -> None:
    if (turns_deg is None) == (poses is None):
        raise UsageError(
            f"give the camera directions, {EXAMPLE}, or the camera poses, --poses transforms.json, but not both"
        )
    turns = len(paths) if turns_deg is None else len(turns_deg)
    if not 2 <= len(paths) <= MOST_GIVEN or turns != len(paths):
        raise UsageError(
            f"photos: {len(paths)}, turns: {turns}; give 2 to {MOST_GIVEN} photos and one turn for each, {EXAMPLE}"
        )
    twice = first_duplicate([str(path.resolve()) for path in paths])
    if twice is not None:
        raise UsageError(f"{Path(twice).name} is given twice; give each photo once")
    if turns_deg is not None and not np.isfinite(turns_deg).all():
        raise UsageError(f"a turn is not a number; give degrees, {EXAMPLE}")
    if turns_deg is not None and not are_crossing(turns_deg):
        raise UsageError(
            "all photos are from one direction or its opposite; give one from the side, such as 90 degrees"
        )


def _thinned(
    paths: Sequence[Path], turns_deg: Sequence[float] | None, poses: Path | None
) -> tuple[Sequence[Path], Sequence[float] | None]:
    """Return the photos that are used, and their turns."""
    try:
        kept = select_photos(paths, turns_deg or (), poses)
    except InputError as error:
        raise UsageError(f"--poses: {error.detail}") from error
    return [paths[number] for number in kept], None if turns_deg is None else [turns_deg[number] for number in kept]


def _stated(paths: Sequence[Path], poses: Path, up: str, units: str) -> StatedPoses:
    try:
        return stated_poses([path.resolve() for path in paths], poses, up, units)
    except InputError as error:
        raise UsageError(f"--poses: {error.detail}") from error


def _cut_out(paths: Sequence[Path], name: str | None, masks: Sequence[Path | None]) -> _CutOut:
    """Cut photos out as a build does. Raises Rejected if fewer than two are left."""
    stage, names = PhotoStage(MattingConfig()), distinct_names([str(path.resolve()) for path in paths])
    found = _CutOut({}, [], identical_file_messages([str(path.resolve()) for path in paths]))
    reasons = []
    for number, (path, called, mask) in enumerate(zip(paths, names, masks, strict=True)):
        try:
            rgba, field = stage.cut_out(path, name, reject_doubted, called, mask)
        except InputError:
            raise
        except Rejected as doubt:
            reasons.append(doubt.reason)
            found.findings.append(f"left out: {doubt.detail}")
            continue
        found.photos[number] = called, rgba
        found.focals_mm.append(field["focal_mm"])
        found.findings.extend(f"{called}: {finding}" for finding in field["findings"])
    if len(found.photos) < 2:
        left = "none" if not found.photos else f"only {next(iter(found.photos.values()))[0]}"
        raise Rejected(
            reasons[0],
            f"{left} of {len(paths)} photos could be cut out; {'; '.join(found.findings)}",
            "generate",
        )
    return found


def _posed(
    photos: list[tuple[str, np.ndarray]],
    numbers: list[int],
    turns: list[float],
    stated: StatedPoses,
    findings: list[str],
) -> CarvedPhotos:
    carved, longest = carve_posed(photos, [stated.cameras[number] for number in numbers], turns)
    part = carved_part(carved)
    size = (
        "their unit is not stated, and the mesh has none"
        if stated.unit_m is None
        else f"their unit is {stated.unit_said}"
    )
    told = f"{stated.file}: up is {stated.up.said}; {size}"
    if stated.unit_m is not None:
        part = scaled_part(part, longest * stated.unit_m)
    return CarvedPhotos(carved, part, [*findings, told, *_left_out(carved)], metric=stated.unit_m is not None)


def _left_out(carved: CarvedSolid) -> list[str]:
    return [f"{left}: left out, its outline does not go with those of the other photos" for left in carved.left_out]
