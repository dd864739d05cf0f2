"""Publication of a data set: select by licence, plan shards, and write shards, tables and card."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa

from manitwin.dataset.index.part_list import PartList
from manitwin.dataset.index.tables import parquet
from manitwin.dataset.publish.card import CardFacts, dataset_card
from manitwin.dataset.publish.card_statistics import COLUMNS
from manitwin.dataset.publish.licences import (
    LICENSES_MD,
    LicencePolicy,
    Selection,
    licenses_page,
    select,
    terms_of,
    without_attribution,
)
from manitwin.dataset.publish.privacy import local_paths
from manitwin.dataset.publish.publication import Publication
from manitwin.dataset.publish.shard_plan import HUB_FILE_BYTES, Shard, ShardTwin, plan_shards, tar_bytes_of_twins
from manitwin.dataset.publish.shards import write_shard
from manitwin.dataset.publish.tables import (
    INDEX,
    PUBLISHED,
    SHARDS,
    SHARDS_FILE,
    parts_of_index,
    published_rows,
    rows_of_table,
)
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot

SHARD_SIZE_MB = 1000
"""Size of a shard, a convenient download to inspect a category: a few hundred twins."""

PICTURES = 3
PICTURE_FOLDER = "pictures"
CARD, README = "card.png", "README.md"
MEGABYTE = 10**6


@dataclass(frozen=True)
class ShardDone:
    """Progress event: shard ``number`` of ``total`` is in place; ``kept`` if it already existed."""

    name: str
    number: int
    total: int
    kept: bool


@dataclass(frozen=True)
class Published:
    """Counts of a publication.

    ``left_out`` counts accepted twins by licence, ``rehearsals`` those left out because a rehearsal server made part of them, and
    ``without_attribution`` published twins whose licence requires an attribution that is missing. ``rows`` is the number of rows
    per published table.
    """

    twins: int
    left_out: dict[str, int]
    rejected: int
    without_attribution: int
    shards: int
    kept_shards: int
    files: int
    bytes: int
    rows: dict[str, int] = field(default_factory=dict)
    rehearsals: int = 0


def publish_dataset(
    dataset: str | Path,
    out: str | Path,
    *,
    license_allow: Iterable[str] | None = None,
    with_rehearsals: bool = False,
    shard_size_mb: int = SHARD_SIZE_MB,
    twins_per_shard: int | None = None,
    name: str | None = None,
    on_shard: Callable[[ShardDone], None] = lambda done: None,
) -> Published:
    """Write WebDataset shards, Parquet tables, dataset card, licences and digests of a data set to ``out``.

    ``dataset`` and ``out`` are folders or URLs; the index of the data set must be up to date. ``license_allow`` names the
    licences to publish, by default all but ``unknown``. Twins that a rehearsal server (``manitwin fake``) helped to make are kept
    back unless ``with_rehearsals``. A shard holds at most ``shard_size_mb`` (10^6 bytes), or a single larger twin, and at most
    ``twins_per_shard`` twins. The same data set gives the same bytes. After an interruption, call it again: finished shards are
    kept. Raises UsageError for invalid arguments, and TwinError for a twin that is altered, incomplete or names a local folder.
    """
    _check_limits(shard_size_mb, twins_per_shard)
    source, publication = DatasetRoot(dataset), Publication(DatasetRoot(out))
    tar_bytes = tar_bytes_of_twins(source)
    parts = parts_of_index(source, set(tar_bytes))
    columns = ["twin_id", "revision", "license", "attribution", "category", "seconds", "cpu_seconds", "cost_usd"]
    columns.append("failed_checks")
    rows = rows_of_table(source, parts, "twins", columns)
    selection = select("accepted twin", terms_of(rows), LicencePolicy(license_allow, with_rehearsals))
    shards = plan_shards(
        _shard_twins(rows, tar_bytes, selection), max_bytes=shard_size_mb * MEGABYTE, max_twins=twins_per_shard
    )
    title = name or Path(str(out).rstrip("/")).name
    try:
        publication.begin()
        kept = _write_shards(source, publication, shards, on_shard)
        twins, counts = _write_tables(source, publication, parts, shards, selection)
        sizes = [publication.sizes[shard.name] for shard in shards]
        _write_pages(source, publication, CardFacts(title, twins, counts, sizes, _pictures(source, twins)))
        publication.finish()
    except OSError as error:
        raise UsageError(
            f"{out}: not finished ({error}); fix this and publish again, finished shards are kept"
        ) from error
    return Published(
        twins=len(selection.published),
        left_out=selection.left_out,
        rejected=parts.rows("rejections"),
        without_attribution=len(without_attribution(r for r in rows if r["twin_id"] in selection.published)),
        shards=len(shards),
        kept_shards=kept,
        files=len(publication.sizes) + 1,
        bytes=sum(publication.sizes.values()),
        rows=counts,
        rehearsals=selection.rehearsals,
    )


def _check_limits(shard_size_mb: int, twins_per_shard: int | None) -> None:
    if not 1 <= shard_size_mb <= HUB_FILE_BYTES // MEGABYTE:
        raise UsageError(f"--shard-size-mb is {shard_size_mb}; give 1 to {HUB_FILE_BYTES // MEGABYTE}")
    if twins_per_shard is not None and twins_per_shard < 1:
        raise UsageError(f"--twins-per-shard is {twins_per_shard}; give 1 or more")


def _shard_twins(rows: list[dict[str, Any]], tar_bytes: Mapping[str, int], selection: Selection) -> list[ShardTwin]:
    return [
        ShardTwin(
            twin_id=row["twin_id"],
            revision=row["revision"],
            category=row["category"],
            tar_bytes=tar_bytes[row["twin_id"]],
            costs=(row["seconds"], row["cpu_seconds"], row["cost_usd"]),
        )
        for row in rows
        if row["twin_id"] in selection.published
    ]


def _write_shards(
    source: DatasetRoot, publication: Publication, shards: list[Shard], on_shard: Callable[[ShardDone], None]
) -> int:
    """Write all missing shards; return the number of shards that already existed."""
    places = local_paths([source, publication.root])
    kept = 0
    for number, shard in enumerate(shards, 1):
        there = publication.has(shard)
        if not there:
            publication.write_shard(shard, partial(write_shard, root=source, shard=shard, places=places))
        kept += there
        on_shard(ShardDone(shard.name, number, len(shards), there))
    return kept


def _write_tables(
    source: DatasetRoot, publication: Publication, parts: PartList, shards: list[Shard], selection: Selection
) -> tuple[list[dict[str, Any]], dict[str, int]]:
    """Write the tables; return the twin columns that the card needs, and the number of rows per table."""
    shard_of = {twin.twin_id: shard.name for shard in shards for twin in shard.twins}
    counts = {**dict.fromkeys(PUBLISHED, 0), "shards": len(shards)}
    twins: list[dict[str, Any]] = []
    for number, rows in enumerate(published_rows(source, parts, shard_of, selection.kept_back)):
        for table, each in rows.items():
            publication.write(f"{INDEX}/{table}-{number:05d}.parquet", parquet(each))
            counts[table] += len(each)
        twins += rows["twins"].select(list(COLUMNS)).to_pylist()
    written = pa.Table.from_pylist([publication.row(shard) for shard in shards], schema=SHARDS)
    publication.write(SHARDS_FILE, parquet(written))
    return twins, counts


def _write_pages(source: DatasetRoot, publication: Publication, facts: CardFacts) -> None:
    """Write the card's pictures, the licence page and the card."""
    for picture in facts.pictures:
        twin_id = Path(picture).stem
        publication.write(picture, source.read_bytes(f"{source.twin_name(twin_id)}/{CARD}"))
    publication.write(LICENSES_MD, licenses_page(facts.name, facts.twins).encode())
    publication.write(README, dataset_card(facts).encode())


def _pictures(source: DatasetRoot, twins: list[dict[str, Any]]) -> list[str]:
    """Return the pictures to show: cards of the twins with most verified grasps, one per category."""
    best: dict[str, str] = {}
    for twin in sorted(twins, key=lambda twin: (-twin["verified"], twin["twin_id"])):
        best.setdefault(twin["category"], twin["twin_id"])
    shown = [
        twin_id for twin_id in list(best.values())[:PICTURES] if source.exists(f"{source.twin_name(twin_id)}/{CARD}")
    ]
    return [f"{PICTURE_FOLDER}/{twin_id}.png" for twin_id in shown]
