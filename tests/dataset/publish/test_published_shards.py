"""What webdataset, trimesh and the twins themselves say of the shards."""

from __future__ import annotations

import gc
import io
import json
import tarfile
import warnings
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
import trimesh
from made_twins import index, make_twin

import manitwin
from manitwin.dataset.index.parts import indexed_twins, write_part
from manitwin.dataset.publish.publish import publish_dataset
from manitwin.dataset.publish.shard_plan import archive_bytes
from manitwin.dataset.publish.shards import unpack_shard
from manitwin.errors import TwinError, UsageError
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.store import RECORD, read_record, write_twin_record


def shards_of(out: Path) -> list[Path]:
    return sorted((out / "data").rglob("*.tar"))


def samples_of(out: Path, decode: bool = False) -> list[dict[str, Any]]:
    import webdataset

    pipeline = webdataset.WebDataset([str(shard) for shard in shards_of(out)], shardshuffle=False)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # webdataset leaves its files to the garbage collector
        samples = list(pipeline.decode() if decode else pipeline)
        gc.collect()
    return samples


def test_webdataset_yields_every_twin_once_with_its_files(dataset: Path, published: Path) -> None:
    every = samples_of(published)
    samples = {sample["__key__"]: sample for sample in every}
    allowed = {t for t in DatasetRoot(dataset).twin_ids() if t[0] in "ab"}
    assert set(samples) == allowed and len(every) == 6
    for twin_id, sample in samples.items():
        folder = dataset / twin_name(twin_id)
        assert sample["twin.json"] == (folder / RECORD).read_bytes()
        assert sample["visual.glb"] == (folder / "visual.glb").read_bytes()
        assert sample["rgb_01.webp"] == (folder / "views" / "rgb_01.webp").read_bytes()
        assert sample["source.zip"] == (folder / "source.zip").read_bytes()
        held = pq.read_table(io.BytesIO(sample["grasps.parquet"]))["verified"].to_pylist()
        assert sum(held) == json.loads(sample["twin.json"])["grasps"]["verified"]


def test_webdataset_decodes_the_record(published: Path) -> None:
    assert all(sample["twin.json"]["twin_id"] == sample["__key__"] for sample in samples_of(published, decode=True))


def test_trimesh_reads_the_hulls_as_they_are(dataset: Path, published: Path) -> None:
    sample = samples_of(published)[0]
    scene = trimesh.load(io.BytesIO(sample["collision.zip"]), file_type="zip")
    hulls = manitwin.load(dataset / twin_name(sample["__key__"])).hulls
    assert len(scene.geometry) == len(hulls) == 2
    assert sum(mesh.volume for mesh in scene.geometry.values()) == pytest.approx(sum(hull.volume for hull in hulls))


def test_shards_are_by_category_and_as_small_as_asked(published: Path) -> None:
    names = [shard.relative_to(published).as_posix() for shard in shards_of(published)]
    assert names == [
        "data/mug/mug-000000.tar",
        "data/mug/mug-000001.tar",
        "data/salad-bowl/salad-bowl-000000.tar",  # two spellings of one name
    ]


def test_members_have_no_owner_and_no_date(published: Path) -> None:
    with tarfile.open(shards_of(published)[0]) as tar:
        members = tar.getmembers()
    assert {(m.mtime, m.uid, m.gid, m.uname, m.gname, m.mode) for m in members} == {(0, 0, 0, "", "", 0o644)}
    assert [m.name for m in members] == sorted(m.name for m in members)


def test_shard_is_no_larger_than_planned(tmp_path: Path) -> None:
    root = tmp_path / "set"
    for number in range(12):
        make_twin(root, f"{number:016x}", source_bytes=200_000 * (number % 3))
    index(root)
    publish_dataset(root, tmp_path / "out", shard_size_mb=1)
    sizes = [shard.stat().st_size for shard in shards_of(tmp_path / "out")]
    assert len(sizes) > 1 and max(sizes) <= 10**6 and sum(sizes) > 2_000_000
    assert all(size == archive_bytes(size - 1024) for size in sizes)


def test_unpacked_twins_pass_verification_and_can_be_indexed(dataset: Path, published: Path, tmp_path: Path) -> None:
    folders = [folder for shard in shards_of(published) for folder in unpack_shard(shard, tmp_path / "set")]
    assert len(folders) == 6
    for folder in folders:
        twin = manitwin.load(folder, verify=True)
        assert twin.record == read_record(dataset / twin_name(folder.name))
        assert len(twin.hulls) == 2 and len(twin.grasps()) == twin.record.grasps.verified
    root = DatasetRoot(tmp_path / "set")
    write_part(root, list(root.twin_ids()))
    assert set(indexed_twins(root)) == {folder.name for folder in folders}
    assert not [path for path in (tmp_path / "set").iterdir() if path.name.startswith(".unpack")]


def test_same_twins_give_the_same_bytes(dataset: Path, published: Path, tmp_path: Path) -> None:
    publish_dataset(dataset, tmp_path / "small-set", twins_per_shard=2)
    for path in sorted(p for p in published.rglob("*") if p.is_file()):
        assert (tmp_path / "small-set" / path.relative_to(published)).read_bytes() == path.read_bytes(), path.name


@pytest.mark.parametrize("what", ["altered", "missing", "newer"])
def test_damaged_or_newer_twin_stops_the_publication(tmp_path: Path, what: str) -> None:
    root = tmp_path / "set"
    folder = make_twin(root, "a000000000000000")
    index(root)
    if what == "altered":
        (folder / "card.png").write_bytes(b"other")
    elif what == "missing":
        (folder / "card.png").unlink()
    else:
        record = read_record(folder).model_dump(mode="json", exclude={"revision"})
        write_twin_record(folder, {**record, "name": "other"})
    error, words = (UsageError, "manitwin index") if what == "newer" else (TwinError, "card.png")
    with pytest.raises(error, match=words):
        publish_dataset(root, tmp_path / "out")
    assert not (tmp_path / "out" / "SHA256SUMS").exists() and not list((tmp_path / "out").rglob("*.tar"))
