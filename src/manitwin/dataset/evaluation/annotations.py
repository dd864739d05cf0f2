"""``manitwin evaluate annotations``: a data set's annotations against labels, by the paper's five dimensions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from statistics import median

import numpy as np
import trimesh

from manitwin.dataset.evaluation.annotation_scores import (
    DIMENSIONS,
    Score,
    score_annotations,
)
from manitwin.dataset.evaluation.labels import read_labels
from manitwin.dataset.evaluation.part_names import is_same_part
from manitwin.engine.ledger.location import local_ledger
from manitwin.engine.ledger.reading import read_ledger
from manitwin.errors import UsageError
from manitwin.formats.json_file import parse_json_object
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import Twin, TwinSource
from manitwin.twin.proportions import wilson_interval

SHOWN = 5


@dataclass(frozen=True)
class PointDistance:
    """Distance (m) of a functional point from the part that its label names; None if the twin has no such part."""

    twin_id: str
    point: str
    label: str
    distance_m: float | None


@dataclass(frozen=True)
class AnnotationReport:
    """Scores of all questions, distances of functional points, and the labels without a twin."""

    twins: int
    scores: tuple[Score, ...]
    distances: tuple[PointDistance, ...]
    without_twin: tuple[str, ...]

    def shares(self) -> dict[str, tuple[int, int]]:
        """Return (right, asked) per dimension, and per question within it except for single points."""
        counts: dict[str, tuple[int, int]] = {}
        for score in self.scores:
            kind = score.question if score.dimension in ("language", "physical") else score.question.partition(" ")[2]
            for name in (score.dimension, *([f"{score.dimension}: {kind}"] if kind else [])):
                right, asked = counts.get(name, (0, 0))
                counts[name] = right + score.right, asked + 1
        return {name: counts[name] for name in sorted(counts, key=_sort_key)}

    def lines(self) -> list[str]:
        """Return the table as text, then the distances, then the wrong answers."""
        lines = [f"{self.twins} twins with labels"]
        for name, (right, asked) in self.shares().items():
            low, high = wilson_interval(right, asked)
            lines.append(f"{name:<26} {right:>4} of {asked:<4} {right / asked:6.1%} [{low:.1%}, {high:.1%}]")
        told = [each.distance_m for each in self.distances if each.distance_m is not None]
        if told:
            off = [each * 1000 for each in told]
            lines.append(
                f"functional points to the part that they name: median {median(off):.1f} mm, largest {max(off):.1f} mm"
                f" ({len(told)} of {len(self.distances)} name a part of the surface)"
            )
        if self.without_twin:
            some = ", ".join(self.without_twin[:SHOWN]) + (", ..." if len(self.without_twin) > SHOWN else "")
            lines.append(f"{len(self.without_twin)} labels without an accepted twin: {some}")
        lines += [
            f"wrong: {score.twin_id} {score.dimension} {score.question}: {score.said}; true: {score.truth}"
            for score in self.scores
            if not score.right
        ]
        return lines


def evaluate_annotations(dataset: str, labels: Path) -> AnnotationReport:
    """Score every accepted twin that has a label.

    A label refers to a twin by ``twin_id``, or by the end of the input's path in ``file`` (looked up in the data set's ledger).
    Raises UsageError for labels that cannot be read, a data set without twins, or if no label has a twin.
    """
    known, source = read_labels(labels), TwinSource(dataset)
    paths = _inputs(dataset)
    twin_ids = set(source.twin_ids())
    scores: list[Score] = []
    distances: list[PointDistance] = []
    missing, found = [], 0
    for label in known:
        twin_id = label.twin_id or _find_twin_id(label.file, paths)
        twin = source.twin(twin_id) if twin_id in twin_ids and twin_id is not None else None
        if twin is None or twin.record.status != "accepted":
            missing.append(label.file or str(label.twin_id))
            continue
        found += 1
        scores += score_annotations(twin.record, label)
        distances += _distances(twin)
    if not found:
        raise UsageError(
            f"{labels}: none of its {len(known)} labels belongs to an accepted twin of {dataset}; give twin_id"
        )
    return AnnotationReport(found, tuple(scores), tuple(distances), tuple(missing))


def _sort_key(name: str) -> tuple[int, str]:
    return DIMENSIONS.index(name.partition(":")[0]), name


def _inputs(dataset: str) -> Mapping[str, str]:
    """Return the twin id of each input by its path, from the ledger; empty if the data set has none."""
    ledger = local_ledger(DatasetRoot(dataset))
    if not ledger.is_file():
        return {}
    with read_ledger(ledger) as rows:
        accepted = rows.execute("SELECT item, twin_id FROM items WHERE state = 'accepted'").fetchall()
    return {_path_of(item, ledger): twin_id for item, twin_id in accepted}


def _path_of(item: str, ledger: Path) -> str:
    said = parse_json_object(item, str(ledger), UsageError)
    return str(said.get("file") or "")


def _find_twin_id(file: str, paths: Mapping[str, str]) -> str | None:
    """Return the twin whose input path ends in ``file``; raises UsageError if there are several."""
    wanted = PurePosixPath(file).parts
    found = {
        twin_id for path, twin_id in paths.items() if wanted and PurePosixPath(path).parts[-len(wanted) :] == wanted
    }
    if len(found) > 1:
        raise UsageError(f"{file}: {len(found)} twins have this input; give twin_id in the labels")
    return next(iter(found), None)


def _distances(twin: Twin) -> Iterable[PointDistance]:
    """Yield the distance of each functional point to the nearest face of the part that its label names."""
    points, parts = twin.record.points, twin.record.parts
    if points is None:
        return
    triangles = face_parts = None
    for point in points.functional:
        named = [place for place, part in enumerate(parts) if is_same_part(part.name, point.label)]
        if named and triangles is None:
            triangles = np.concatenate([np.asarray(mesh.triangles) for mesh in twin.visual])
            face_parts = twin.face_parts()
        distance_m = None
        if named:
            assert triangles is not None and face_parts is not None
            of_part = triangles[np.isin(face_parts, named)]
            if len(of_part):
                place = np.tile(np.array(point.position_m), (len(of_part), 1))
                nearest = trimesh.triangles.closest_point(of_part, place)
                distance_m = float(np.linalg.norm(nearest - place, axis=1).min())
        yield PointDistance(twin.record.twin_id, point.id, point.label, distance_m)
