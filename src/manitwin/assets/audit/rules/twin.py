"""TWN rules: consistency of a twin's record with its files."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.errors import TwinError
from manitwin.geometry.frames.feature_deviation import ON_FEATURE_M, feature_deviation_m
from manitwin.geometry.frames.label_keywords import is_compatible_kind
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.part_records import NO_PART

CANDIDATE_M, CANDIDATE_SHARE = 0.005, 0.03
"""Largest distance of a candidate point from the visual surface: it was sampled on the repaired solid, which may deviate."""

SIDE_M, SIDE_SHARE = 0.001, 0.01
"""Allowed difference of a side in the record from the mesh, in metres and as share of the longest side."""

LINK_MASS_SHARE = 1e-3
"""Relative difference between the sum of the link masses and the twin's mass that rounding explains."""


def candidates_off_surface(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report candidate points off the surface."""
    if measured.record is None or measured.record.points is None or not len(measured.samples):
        return
    points = np.array(measured.record.points.candidates.positions_m, float).reshape(-1, 3)
    if not len(points):
        return
    limit = max(CANDIDATE_M, CANDIDATE_SHARE * measured.longest_m)
    distance = measured.distance_m(points, limit)
    if (distance > limit).any():
        yield Complaint(
            f"{int((distance > limit).sum())} of {len(points)} candidate points lie up to {1000 * distance.max():.3g} mm off"
            " the surface",
            values={"off": int((distance > limit).sum()), "farthest_m": float(distance.max())},
        )


def extents_differ(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a record whose extents differ from the mesh."""
    if measured.record is None or measured.record.physical is None or measured.bounds is None:
        return
    said, real = np.array(measured.record.physical.extents_m), np.ptp(measured.bounds, axis=0)
    apart = float(np.abs(said - real).max())
    if apart > max(SIDE_M, SIDE_SHARE * measured.longest_m):
        sides = [" x ".join(f"{1000 * side:.4g}" for side in box) for box in (said, real)]
        yield Complaint(
            f"the record says {sides[0]} mm, the mesh measures {sides[1]} mm",
            values={"said_m": said.tolist(), "measured_m": real.tolist()},
        )


def face_parts_differ(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report part labels that do not match the faces of the visual mesh, or the face counts of the record."""
    if measured.record is None or not measured.record.parts:
        return
    path = measured.asset.path
    try:
        labels = Twin(path.parent if path.is_file() else path).face_parts()
    except TwinError as error:
        yield Complaint(str(error).rpartition("; ")[0])
        return
    counts = np.bincount(labels, minlength=NO_PART + 1)
    for place, part in enumerate(measured.record.parts):
        if counts[place] != part.faces:
            yield Complaint(
                f"part {part.id}, {part.name}, has {counts[place]} faces, the record says {part.faces}",
                values={"part": part.id, "faces": int(counts[place]), "said": part.faces},
            )


def links_differ(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report links whose total mass, faces or hulls differ from those of the twin."""
    record = measured.record
    if record is None or not record.links or record.physical is None:
        return
    path = measured.asset.path
    try:
        twin = Twin(path.parent if path.is_file() else path)
        labels, hulls = twin.face_links(), len(twin.hulls)
    except TwinError as error:
        yield Complaint(str(error).rpartition("; ")[0])
        return
    counts = np.bincount(labels, minlength=len(record.links)).tolist()
    said = [link.faces for link in record.links]
    if counts != said:
        yield Complaint(
            f"its links have {', '.join(map(str, counts))} faces, the record says {', '.join(map(str, said))}",
            values={"faces": counts, "said": said},
        )
    numbers = sorted(number for link in record.links for number in link.hulls)
    if numbers != list(range(hulls)):
        yield Complaint(
            f"its {hulls} hulls are not each of one link", values={"hulls": hulls, "of_links": numbers[:200]}
        )
    total_kg, whole_kg = sum(link.mass_kg for link in record.links), record.physical.mass_kg.value
    if abs(total_kg / whole_kg - 1) > LINK_MASS_SHARE:
        yield Complaint(
            f"its links weigh {total_kg:.4g} kg together, the twin {whole_kg:.4g} kg",
            values={"links_kg": total_kg, "twin_kg": whole_kg},
        )


def frames_off_feature(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report functional frames that are away from their feature."""
    if measured.record is None or measured.record.points is None or not len(measured.samples):
        return
    limit = max(ON_FEATURE_M, measured.spacing_m)
    off = {
        point.id: feature_deviation_m(
            point.frame.kind,
            np.array(point.frame.position_m),
            rotation_from_quaternion_wxyz(np.array(point.frame.quaternion_wxyz)),
            point.frame.size_m,
            measured.samples,
            measured.visual,
        )
        for point in measured.record.points.functional
        if point.frame is not None
    }
    far = {name: away for name, away in off.items() if away > limit}
    if far:
        said = ", ".join(f"{name} {1000 * away:.0f} mm" for name, away in far.items())
        yield Complaint(
            f"functional frames off the feature that they are of: {said}", values={"off_m": list(far.values())}
        )


def frame_kinds(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report frames of a kind that does not fit the label of their point."""
    if measured.record is None or measured.record.points is None:
        return
    odd = [
        f"{point.id} {point.label!r} as {point.frame.kind}"
        for point in measured.record.points.functional
        if point.frame is not None and not is_compatible_kind(point.label, point.frame.kind)
    ]
    if odd:
        yield Complaint(
            f"frames of a kind that their label does not mean: {', '.join(odd)}", values={"count": len(odd)}
        )


RULES = (
    Rule(
        "TWN001",
        "candidates-off-surface",
        "error",
        why="Functional and grasp points are chosen among the candidates: off the surface they belong to another mesh or scale.",
        remedy="Build the twin again from its source.",
        check=candidates_off_surface,
    ),
    Rule(
        "TWN002",
        "extents-differ",
        "error",
        why="The record's size is what people search and filter by; where the mesh has another one, the scale was applied to one"
        " of them only.",
        remedy="Build the twin again from its source.",
        check=extents_differ,
    ),
    Rule(
        "TWN003",
        "face-parts-differ",
        "error",
        why="Parts are told face by face in the order of visual.glb: with another number of faces, or parts that the record has"
        " not, every region of a grasp and every name of a part is wrong.",
        remedy="Build the twin again from its source.",
        check=face_parts_differ,
    ),
    Rule(
        "TWN004",
        "frame-off-feature",
        "error",
        why="A skill moves to the frame: pours over the lip, strikes with the face. 5 mm beside the surface, or of an opening or"
        " hole beside the plane of its walls, it pours beside and strikes the air.",
        remedy="Build the twin again; where a person has set the frame, set it to null or to its feature.",
        check=frames_off_feature,
    ),
    Rule(
        "TWN005",
        "frame-kind-unfitting",
        "warning",
        why="The kind says what a skill may do with a frame: an opening at a point called 'blade' is poured into for nothing.",
        remedy="Mend the label or the frame's kind.",
        check=frame_kinds,
    ),
    Rule(
        "TWN006",
        "links-differ",
        "error",
        why="Links are told face by face and hull by hull, and weigh together what the twin does: else an export with joints is"
        " another thing than the locked one that was verified.",
        remedy="Import the asset and build the twin again.",
        check=links_differ,
    ),
)
