"""Write affordance maps and parts of a data set's twins in the formats that training code reads."""

from __future__ import annotations

import io
import json
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import astuple, dataclass
from math import isfinite
from pathlib import Path

import numpy as np

from manitwin.dataset.affordances.baselines import baseline_scores, part_shares
from manitwin.dataset.affordances.maps import SurfaceMaps, has_parts, surface_maps
from manitwin.dataset.affordances.partnext import PartNextFolder
from manitwin.dataset.affordances.report import affordances_page, sample_picture
from manitwin.dataset.affordances.splits import split_twins
from manitwin.dataset.catalog.groups import SPLITS
from manitwin.dataset.report_page import Picture
from manitwin.errors import TwinError, UsageError
from manitwin.formats.output_folder import new_folder
from manitwin.robots.grippers.gripper import Gripper
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.part_records import NO_PART
from manitwin.twin.store import canonical_json

POINTS, TRIALS = 2048, 200
SHOWN = 24
"""Number of twins shown in the report."""


@dataclass(frozen=True)
class AffordanceSummary:
    """Summary: twins with maps, twins with parts, twins left out with reasons, and the repeatability of the grasp maps."""

    twins: int
    with_grasp_map: int
    with_parts: int
    left_out: dict[str, str]
    median_similarity: float | None
    median_area_under_curve: float | None


def write_affordances(
    dataset: str | Path,
    out: str | Path,
    *,
    points: int = POINTS,
    trials: int = TRIALS,
    seed: int = 0,
    grippers: Sequence[Gripper] = (),
    on_twin: Callable[[SurfaceMaps], None] = lambda maps: None,
) -> AffordanceSummary:
    """Write the maps of all accepted twins of a local data set to ``out``, atomically.

    ``maps/<twin>.npz`` has the fields of 3D AffordanceNet. For twins with known parts, ``parts/`` has the layout of ShapeNetPart
    and ``partnext/`` that of PartNeXt. ``affordances.json`` lists all twins, ``report.html`` shows some. ``grippers`` are
    user-defined grippers that twins were built with. Raises UsageError for a data set at a URL or without accepted twins, and for
    an ``out`` that is not empty.
    """
    accepted = _accepted_twins(dataset)
    splits, left_out = split_twins(accepted)
    twins = [twin for twin in accepted if twin.record.twin_id in splits]
    kinds = sorted({f"{_category(twin)}/{part.name}" for twin in twins for part in twin.record.parts})
    part_ids = {name: number for number, name in enumerate(kinds)}
    rows: list[dict[str, object]] = []
    samples: list[Picture] = []
    in_splits: dict[str, list[str]] = defaultdict(list)
    with new_folder(Path(out)) as folder, PartNextFolder(folder / "partnext") as partnext:
        for twin in twins:
            try:
                maps = surface_maps(twin, points=points, trials=trials, seed=seed, grippers=grippers)
            except (TwinError, UsageError) as error:
                left_out[twin.record.twin_id] = str(error)
                continue
            on_twin(maps)
            _write(folder / "maps" / f"{twin.record.twin_id}.npz", maps_file(maps))
            if has_parts(maps):
                category, name = category_folder(_category(twin)), twin.record.twin_id
                _write(folder / "parts" / category / f"{name}.txt", parts_file(maps, part_ids))
                in_splits[splits[name]].append(f"shape_data/{category}/{name}")
                partnext.add(twin, category)
            rows.append(_row(maps, splits[maps.twin.record.twin_id]))
            if len(samples) < SHOWN:
                samples.append(sample_picture(maps))
        _write_part_lists(folder / "parts", sorted({category_folder(_category(twin)) for twin in twins}), in_splits)
        listed = {
            "points": points,
            "trials": trials,
            "seed": seed,
            "parts": part_ids,
            "twins": rows,
            "left_out": left_out,
        }
        _write(folder / "affordances.json", canonical_json(listed).encode())
        with_parts = sum(map(len, in_splits.values()))
        _write(folder / "report.html", affordances_page(rows, left_out, samples, with_parts))
    agreements = [row["agreement"]["grasp"] for row in rows if "grasp" in row["agreement"]]  # type: ignore[index, operator]
    sim, auc = np.nanmedian(np.array(agreements, float), axis=0) if agreements else (None, None)
    return AffordanceSummary(
        twins=len(rows),
        with_grasp_map=sum("grasp" in row["maps"] for row in rows),  # type: ignore[operator]
        with_parts=with_parts,
        left_out=left_out,
        median_similarity=None if sim is None else float(sim),
        median_area_under_curve=None if auc is None else float(auc),
    )


def _accepted_twins(dataset: str | Path) -> list[Twin]:
    root = DatasetRoot(dataset)
    if root.local is None:
        raise UsageError(
            f"{dataset}: is at a URL; copy the data set to this machine, since all files of its twins are read"
        )
    twins = (Twin(root.local / root.twin_name(each)) for each in root.twin_ids())
    accepted = [twin for twin in twins if twin.record.status == "accepted"]
    if not accepted:
        raise UsageError(f"{dataset}: has no accepted twin; build twins, or give another data set")
    return accepted


def maps_file(maps: SurfaceMaps) -> bytes:
    """Return the content of a twin's .npz file: the fields of 3D AffordanceNet, and the inverse of its normalization.

    ``coordinate (N, 3)`` is centred on the points' mean and scaled to the unit sphere: m = coordinate * scale_m + center_m.
    """
    center = maps.points_m.mean(0)
    scale = float(np.linalg.norm(maps.points_m - center, axis=1).max())
    arrays = {
        "shape_id": np.array(maps.twin.record.twin_id),
        "semantic_class": np.array(_category(maps.twin)),
        "affordance": np.array(list(maps.maps), str),
        "coordinate": ((maps.points_m - center) / scale).astype(np.float32),
        "label": np.stack(list(maps.maps.values()), 1).astype(np.float32)
        if maps.maps
        else np.zeros((len(maps.points_m), 0)),
        "center_m": center,
        "scale_m": np.array(scale),
        "normal": maps.normals.astype(np.float32),
        "part": maps.parts,
        "face": maps.faces.astype(np.int32),
    }
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def category_folder(category: str) -> str:
    """Return a category as a folder name of letters, digits and underscores."""
    return re.sub(r"[^\w]+", "_", category)[:60].strip("_") or "object"


def parts_file(maps: SurfaceMaps, part_ids: dict[str, int]) -> bytes:
    """Return ShapeNetPart rows ``x y z nx ny nz part`` of the points with a known part, in metres, object frame."""
    kinds = [part_ids[f"{_category(maps.twin)}/{part.name}"] for part in maps.twin.record.parts]
    known = np.flatnonzero(maps.parts != NO_PART)
    rows = [
        " ".join(f"{value:.6f}" for value in (*maps.points_m[i], *maps.normals[i])) + f" {kinds[maps.parts[i]]}"
        for i in known
    ]
    return ("\n".join(rows) + "\n").encode()


def _write_part_lists(folder: Path, categories: list[str], in_splits: dict[str, list[str]]) -> None:
    _write(folder / "synsetoffset2category.txt", "".join(f"{name}\t{name}\n" for name in categories).encode())
    for split, _ in SPLITS:
        file = folder / "train_test_split" / f"shuffled_{split}_file_list.json"
        _write(file, json.dumps(sorted(in_splits.get(split, []))).encode())


def _row(maps: SurfaceMaps, split: str) -> dict[str, object]:
    return {
        "twin_id": maps.twin.record.twin_id,
        "category": _category(maps.twin),
        "split": split,
        "maps": list(maps.maps),
        "tried": maps.tried,
        "held": maps.held,
        "agreement": {name: _rounded(values) for name, values in maps.agreement.items()},
        "blind": {name: _rounded(astuple(scores)) for name, scores in baseline_scores(maps).items()},
        "part_shares": {name: round(share, 4) for name, share in part_shares(maps).items()},
    }


def _rounded(values: Iterable[float]) -> list[float | None]:
    return [round(value, 4) if isfinite(value) else None for value in values]


def _category(twin: Twin) -> str:
    return twin.record.language.category if twin.record.language else "object"


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
