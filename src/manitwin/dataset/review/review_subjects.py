"""The subject of a verdict: a twin's revision, its annotations per dimension, their origin, and its pictures."""

from __future__ import annotations

from pathlib import Path

from manitwin.dataset.index.query import Index
from manitwin.dataset.index.twins import local_files
from manitwin.dataset.review.verdicts import DECIDING_STAGE, DIMENSIONS, Corrections, Dimension
from manitwin.errors import UsageError, unknown_name_message
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import RECORD, read_record

_CARD = "card.png"


def read_twin(root: DatasetRoot, twin_id: str) -> TwinRecord:
    """Return a twin's record; raises UsageError if the data set has no accepted twin of this id."""
    if not root.exists(f"{root.twin_name(twin_id)}/{RECORD}"):
        raise UsageError(f"{twin_id}: not a twin of {root.url}; `manitwin query {root.url} --format ids` lists them")
    with local_files(root, twin_id, (RECORD,)) as folder:
        record = read_record(folder)
    if record.status != "accepted":
        raise UsageError(f"{twin_id}: was rejected, but only accepted twins are reviewed; continue with the next")
    return record


def revisions(index: Index) -> dict[str, str]:
    """Return the revision of each accepted twin of an index."""
    rows = index.select("twins", columns=["twin_id", "revision"])
    return dict(zip(rows["twin_id"].to_pylist(), rows["revision"].to_pylist(), strict=True))


def prompts_of(record: TwinRecord) -> dict[Dimension, str]:
    """Return the origin of the annotations of each dimension: 'BACKEND, MODEL, prompt NAME vN DIGEST'."""
    found: dict[Dimension, str] = {}
    for dimension in DIMENSIONS:
        stage = record.provenance.stages.get(DECIDING_STAGE[dimension])
        if stage is not None:
            found[dimension] = ", ".join(filter(None, (stage.backend, stage.model)))
    return found


def annotation_text(record: TwinRecord, dimension: Dimension, *, blind: bool = False) -> str:
    """Return the annotations of a twin in a dimension as one line of text. ``blind`` omits the interval of the mass."""
    language, physical, points, grasps = record.language, record.physical, record.points, record.grasps
    if dimension == "category" and language is not None:
        return language.category
    if dimension == "language" and language is not None:
        words = (language.color, language.material, language.size, language.shape, language.function)
        return f"{language.caption} ({'; '.join(words)})"
    if dimension == "functional" and points is not None:
        return "; ".join(f"{point.id} {point.label}" for point in points.functional)
    if dimension == "grasp" and points is not None:
        return "; ".join(f"{point.id} {point.label or point.type}" for point in points.grasp)
    if dimension == "physical" and physical is not None:
        mass, sides = physical.mass_kg, " x ".join(f"{side:.3g}" for side in physical.extents_m)
        interval = "" if blind else f" ({mass.low:.3g} to {mass.high:.3g})"
        return f"{mass.value:.3g} kg{interval}, {sides} m, {physical.material}"
    if dimension == "simulation" and grasps is not None:
        return f"{grasps.verified} of {grasps.simulated} grasps held"
    if dimension == "mesh" and record.mesh is not None:
        return f"{record.mesh.faces} faces, {'watertight' if record.mesh.watertight else 'not watertight'}"
    return ""


def check_corrections(record: TwinRecord, corrections: Corrections) -> None:
    """Raise UsageError if corrections name a missing point or candidate, or move two points to one candidate."""
    points = record.points
    if not corrections.points or points is None:
        return
    there = {point.id: point.candidate for point in points.functional}
    there |= {point.id: point.candidate for point in points.grasp}
    count = len(points.candidates.positions_m)
    for point, candidate in corrections.points.items():
        if point not in there:
            raise UsageError(f"{record.twin_id}: {unknown_name_message('point', point, there)}")
        if candidate >= count:
            raise UsageError(f"{record.twin_id}: {point} at candidate {candidate}; there are 0 to {count - 1}")
    moved = there | corrections.points
    for kind in "fg":
        places = [candidate for point, candidate in moved.items() if point[0] == kind]
        if len(set(places)) < len(places):
            raise UsageError(
                f"{record.twin_id}: two points at the same candidate, {sorted(places)}; move each to its own"
            )


def pictures_of(root: DatasetRoot, twin_id: str) -> list[str]:
    """Return the paths (or URLs) of the views that the model was shown, and of the card."""
    name = root.twin_name(twin_id)
    names = [each for each in root.names_below(f"{name}/views") if Path(each).suffix in (".webp", ".png")]
    names += [f"{name}/{_CARD}"] if root.exists(f"{name}/{_CARD}") else []
    base = str(root.local) if root.local is not None else root.url.rstrip("/")
    return [f"{base}/{each}" for each in names]
