"""Write a catalogue of a data set's twins in the formats that retrieval, classification and captioning code reads."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.dataset.catalog.groups import SPLITS, assign_groups, split_of
from manitwin.dataset.catalog.surface import POINTS, SurfacePoints, View, surface_points, views_around
from manitwin.dataset.index.near_duplicates import near_duplicates
from manitwin.dataset.index.query import Index
from manitwin.dataset.report_page import Picture, Section, Table, page
from manitwin.errors import TwinError, UsageError
from manitwin.formats.image_file import png_of
from manitwin.formats.label_picture import label_picture
from manitwin.models.annotators.prior_names import find_prior
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.record import Language
from manitwin.twin.store import canonical_json

SIZE_PX = 224
DATASET = "ManiTwin"
SHOWN_TWINS, SHOWN_VIEWS = 24, (1, 11, 22)


@dataclass(frozen=True)
class Catalog:
    """Summary of a written catalogue: twins per split, pictures, categories, groups of several twins, and twins left out with
    reasons.
    """

    twins: dict[str, int]
    pictures: int
    categories: int
    joined_groups: int
    left_out: dict[str, str]


def write_catalog(
    dataset: str | Path,
    out: str | Path,
    *,
    size_px: int = SIZE_PX,
    seed: int = 0,
    on_twin: Callable[[str], None] = lambda twin_id: None,
) -> Catalog:
    """Write pictures, clouds, captions and lists of all accepted twins of a local data set to ``out``, atomically.

    docs/catalog.md describes the layout. Equal arguments give equal bytes. A twin whose files cannot be read is left out. Raises
    UsageError for a data set at a URL, without an index or without twins, and for an ``out`` that is not empty; TwinError if no
    twin can be read.
    """
    from manitwin.formats.output_folder import new_folder

    root = DatasetRoot(dataset)
    if root.local is None:
        raise UsageError(
            f"{dataset}: is at a URL; copy the data set to this machine, since all files of its twins are read"
        )
    index = Index(root)
    ids: list[str] = index.select("twins", columns=["twin_id"])["twin_id"].to_pylist()
    if not ids:
        raise UsageError(f"{dataset}: has no accepted twin; build twins, or give another data set")
    groups = assign_groups(ids, near_duplicates(index))
    rows: list[dict[str, Any]] = []
    left_out: dict[str, str] = {}
    samples: list[Picture] = []
    with new_folder(Path(out)) as folder:
        for twin_id in ids:
            on_twin(twin_id)
            try:
                twin = Twin(root.local / root.twin_name(twin_id))
                row = _row(twin, groups[twin_id])
                points, views = surface_points(twin, POINTS[0], seed), views_around(twin, size_px)
            except TwinError as error:
                left_out[twin_id] = str(error)
                continue
            _write_clouds(folder, row, points)
            _write_pictures(folder, row, views)
            rows.append(row)
            if len(samples) < SHOWN_TWINS:
                shown = np.concatenate([views[number].rgb for number in SHOWN_VIEWS], axis=1)
                samples.append(Picture(png_of(shown), f"{row['category']} ({row['split']}): {row['captions'][0]}"))
        if not rows:
            raise TwinError(f"no twin of {dataset} can be read; the first: {next(iter(left_out.values()))}")
        _write_lists(folder, rows, left_out)
        joined = Counter(groups[row["twin_id"]] for row in rows)
        done = Catalog(
            {name: sum(row["split"] == name for row in rows) for name, _ in SPLITS},
            sum(len(row["pictures"]) for row in rows),
            len({row["category"] for row in rows}),
            sum(count > 1 for count in joined.values()),
            left_out,
        )
        _write(folder / "report.html", _page(rows, samples, done))
    return done


def _row(twin: Twin, group: str) -> dict[str, Any]:
    record = twin.record
    language = record.language
    assert language is not None  # the schema requires it of accepted twins
    return {
        "twin_id": record.twin_id,
        "revision": record.revision,
        "category": language.category,
        "taxonomy": taxonomy_name(language.category),
        "split": split_of(group),
        "group": group,
        "captions": list(dict.fromkeys([language.caption, *language.captions])),
        "attributes": _attributes(language),
        "license": record.source.license,
        "attribution": record.source.attribution,
        "source_sha256": record.source.sha256,
    }


def _attributes(language: Language) -> dict[str, str]:
    return {name: getattr(language, name) for name in ("color", "material", "size", "shape", "function")}


def taxonomy_name(category: str) -> str:
    """Return a category as a file name without hyphens and dots, at which ULIP's readers split names."""
    return "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in category) or "object"


def _write_clouds(folder: Path, row: dict[str, Any], points: SurfacePoints) -> None:
    """Write a twin's points in metres to ``clouds/``, OpenShape's dictionary of 10,000 points, and ULIP's array of 8,192.

    The OpenShape and ULIP clouds use the axes of OpenShape's Objaverse clouds, +Y up; OpenShape's loader rotates them if ``y_up``
    is set.
    """
    arrays = {
        "xyz_m": points.points_m.astype(np.float32),
        "normal": points.normals.astype(np.float32),
        "rgb": points.rgb,
    }
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]  # numpy's stub takes names for its own flags
    row["cloud"] = f"clouds/{row['twin_id']}.npz"
    _write(folder / row["cloud"], stream.getvalue())
    y_up = points.points_m[:, [0, 2, 1]] * [1, 1, -1]
    row["openshape"] = f"openshape/{row['twin_id']}.npy"
    dictionary: dict[str, Any] = {
        "xyz": y_up.astype(np.float32),
        "rgb": points.rgb.astype(np.float32) / 255,
        "group": row["split"],
        "id": row["twin_id"],
        "dataset": DATASET,
        "text": [row["category"]],
        "blip_caption": "",
        "msft_caption": "",
        "retrieval_text": row["captions"],
    }
    _write(folder / row["openshape"], _npy(np.array(dictionary, dtype=object)))
    row["ulip"] = f"{row['taxonomy']}-{row['twin_id']}.npy"
    _write(folder / "ulip" / "pointclouds" / row["ulip"], _npy(y_up[: POINTS[1]].astype(np.float32)))


def _npy(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=array.dtype == object)
    return stream.getvalue()


def _write_pictures(folder: Path, row: dict[str, Any], views: list[View]) -> None:
    """Write ULIP's views, ``<name>_r_<degrees>.png``, and 8-bit depth images: near is white, far is darker,
    background is black.
    """
    name = f"{row['taxonomy']}-{row['twin_id']}"
    row["pictures"] = []
    for view in views:
        file = f"pictures/{name}/{name}_r_{view.azimuth_deg:03d}"
        _write(folder / f"{file}.png", png_of(view.rgb))
        near, far = view.depth_m[view.depth_m > 0].min(), view.depth_m.max()
        shade = np.where(view.depth_m > 0, 255 - 191 * (view.depth_m - near) / max(far - near, 1e-9), 0)
        _write(folder / f"{file}_depth0001.png", label_picture(np.rint(shade).astype(np.uint8)))
        row["pictures"].append({"file": f"{file}.png", "camera": view.camera.to_json()})


def _write_lists(folder: Path, rows: list[dict[str, Any]], left_out: dict[str, str]) -> None:
    categories = sorted({row["category"] for row in rows})
    numbers = {name: number for number, name in enumerate(categories)}
    listed = {"dataset": DATASET, "categories": numbers, "twins": rows, "left_out": left_out}
    _write(folder / "catalog.json", canonical_json(listed).encode())
    _write(folder / "ulip" / "taxonomy.json", canonical_json([_synset(rows, name) for name in categories]).encode())
    _write(folder / "ulip" / "labels.json", canonical_json({DATASET: categories}).encode())
    for split, _ in SPLITS:
        there = [row for row in rows if row["split"] == split]
        _write(
            folder / "openshape" / f"{split}.json", canonical_json([_openshape_entry(row) for row in there]).encode()
        )
        _write(folder / "ulip" / f"{split}.txt", "".join(f"{row['ulip']}\n" for row in there).encode())
        labelled = [f"{each['file']} {numbers[row['category']]}\n" for row in there for each in row["pictures"]]
        _write(folder / "classification" / f"{split}.txt", "".join(labelled).encode())
        _write(folder / "captions" / f"{split}.json", canonical_json(_coco_captions(there)).encode())
    _write(folder / "classification" / "classes.txt", "".join(f"{name}\n" for name in categories).encode())


def _synset(rows: list[dict[str, Any]], category: str) -> dict[str, Any]:
    prior = find_prior(category)
    names = dict.fromkeys([category, *((prior.category, *prior.aliases) if prior else ())])
    count = sum(row["category"] == category for row in rows)
    return {"synsetId": taxonomy_name(category), "name": ",".join(names), "children": [], "numInstances": count}


def _openshape_entry(row: dict[str, Any]) -> dict[str, str]:
    return {
        "id": row["twin_id"],
        "dataset": DATASET,
        "group": row["split"],
        "data_path": row["openshape"],
        "category": row["category"],
    }


def _coco_captions(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return COCO captions in which every view of a twin has the captions of the twin."""
    images: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    for row in rows:
        for each in row["pictures"]:
            camera, image_id = each["camera"], len(images) + 1
            size = {"width": camera["width_px"], "height": camera["height_px"]}
            images.append({"id": image_id, "file_name": each["file"], "twin_id": row["twin_id"], **size})
            for caption in row["captions"]:
                annotations.append({"id": len(annotations) + 1, "image_id": image_id, "caption": caption})
    return {"info": {"description": DATASET}, "images": images, "annotations": annotations}


def _page(rows: list[dict[str, Any]], samples: list[Picture], done: Catalog) -> bytes:
    splits = [name for name, _ in SPLITS]
    by_category = Counter((row["category"], row["split"]) for row in rows)
    table = Table(
        "Twins by category and split.",
        ("category", *splits),
        [(name, *(by_category[name, split] for split in splits)) for name in sorted({row["category"] for row in rows})],
    )
    largest = max(Counter(row["category"] for row in rows).values())
    lead = [
        f"{len(rows):,} twins of {done.categories:,} categories, {done.pictures:,} pictures: "
        + ", ".join(f"{done.twins[split]:,} in {split}" for split in splits)
        + f". The most common category has {100 * largest / len(rows):.0f} % of them.",
        f"{done.joined_groups:,} groups of twins of one input or of nearly one shape and size are each in one split.",
    ]
    sections = [Section("Samples", samples), Section("Balance", [table])]
    if done.left_out:
        reasons = Table("Twins that were left out.", ("twin", "reason"), list(done.left_out.items()))
        sections.append(Section("Left out", [reasons]))
    return page("Catalogue", lead, sections)


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
