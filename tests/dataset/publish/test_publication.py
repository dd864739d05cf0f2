"""An interrupted publication, an older one, a folder that is somebody else's, and a URL."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

import fsspec
import pytest
from made_twins import index, make_twin

import manitwin.dataset.publish.publish as module
from manitwin.dataset.publish.publication import EPISODES, Publication
from manitwin.dataset.publish.publish import ShardDone, publish_dataset
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot


def files_below(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def stop_after(count: int):
    def stop(done: ShardDone) -> None:
        if done.number == count:
            raise KeyboardInterrupt

    return stop


def test_sums_name_every_file_and_its_digest(published: Path) -> None:
    files = files_below(published)
    lines = files.pop("SHA256SUMS").decode().splitlines()
    assert {line[66:]: line[:64] for line in lines} == {n: hashlib.sha256(c).hexdigest() for n, c in files.items()}


def test_interrupted_publication_goes_on_where_it_stopped(dataset: Path, published: Path, tmp_path: Path) -> None:
    out = tmp_path / "small-set"
    with pytest.raises(KeyboardInterrupt):
        publish_dataset(dataset, out, twins_per_shard=2, on_shard=stop_after(2))
    assert len(list(out.rglob("*.tar"))) == 2 and not (out / "SHA256SUMS").exists()
    kept: list[str] = []
    done = publish_dataset(
        dataset, out, twins_per_shard=2, on_shard=lambda shard: kept.append(shard.name) if shard.kept else None
    )
    assert done.kept_shards == 2 and kept == ["data/mug/mug-000000.tar", "data/mug/mug-000001.tar"]
    assert files_below(out) == files_below(published)


def test_one_that_an_older_version_began_goes_on(dataset: Path, published: Path, tmp_path: Path) -> None:
    out = tmp_path / "small-set"
    with pytest.raises(KeyboardInterrupt):
        publish_dataset(dataset, out, twins_per_shard=2, on_shard=stop_after(1))
    (out / ".publish" / "started").write_bytes(b"")  # as it was when there were twins alone
    with pytest.raises(UsageError, match="it contains an unfinished publication of twins"):
        Publication(DatasetRoot(out), EPISODES).begin()
    assert publish_dataset(dataset, out, twins_per_shard=2).kept_shards == 1
    assert files_below(out) == files_below(published)


def test_full_disk_leaves_no_half_shard(
    dataset: Path, published: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "small-set"
    whole = module.write_shard

    def full(stream, **arguments) -> None:
        stream.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module, "write_shard", full)
    with pytest.raises(UsageError, match="No space left"):
        publish_dataset(dataset, out, twins_per_shard=2)
    assert list(files_below(out)) == [".publish/started"]
    monkeypatch.setattr(module, "write_shard", whole)
    publish_dataset(dataset, out, twins_per_shard=2)
    assert files_below(out) == files_below(published)


def test_killed_publication_leaves_nothing_that_counts(dataset: Path, published: Path, tmp_path: Path) -> None:
    out = tmp_path / "small-set"
    with pytest.raises(KeyboardInterrupt):
        publish_dataset(dataset, out, twins_per_shard=2, on_shard=stop_after(1))
    half = out / ".publish" / "scratch-1" / "shard.tar"
    half.parent.mkdir()
    half.write_bytes(b"half")
    (out / "data" / "mug" / "mug-000000.tar").write_bytes(b"cut")  # its receipt says that it is larger
    assert publish_dataset(dataset, out, twins_per_shard=2).kept_shards == 0
    assert files_below(out) == files_below(published)


def test_grown_data_set_rewrites_only_the_shards_that_change(tmp_path: Path) -> None:
    root, out = tmp_path / "set", tmp_path / "out"
    for number, category in enumerate(("bowl", "cup", "mug")):
        make_twin(root, f"a{number}", category)
    index(root)
    publish_dataset(root, out)
    sums = (out / "SHA256SUMS").read_bytes()
    again = publish_dataset(root, out)
    assert again.kept_shards == 3 and (out / "SHA256SUMS").read_bytes() == sums
    shutil.rmtree(root / "twins" / "a1" / "a1")  # the cup goes, a mug comes
    make_twin(root, "b0", "mug")
    shutil.rmtree(root / "index")
    index(root)
    grown = publish_dataset(root, out)
    assert (grown.twins, grown.shards, grown.kept_shards) == (3, 2, 1)
    assert not (out / "data" / "cup").exists() and not (out / ".publish").exists()
    publish_dataset(root, tmp_path / "fresh" / "out")
    assert files_below(out) == files_below(tmp_path / "fresh" / "out")


def test_folder_of_something_else_is_not_touched(dataset: Path, tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    for out in (tmp_path, dataset):
        before = files_below(out)
        with pytest.raises(UsageError, match="not empty"):
            publish_dataset(dataset, out)
        assert files_below(out) == before
    (tmp_path / "thesis.txt").rename(tmp_path / ".gitattributes")  # a fresh clone of a repository
    publish_dataset(dataset, tmp_path)
    assert (tmp_path / ".gitattributes").read_text() == "mine"


def test_stale_or_missing_index_is_said(tmp_path: Path) -> None:
    root = tmp_path / "set"
    with pytest.raises(UsageError, match="twins/"):
        publish_dataset(root, tmp_path / "out")
    make_twin(root, "a0")
    with pytest.raises(UsageError, match="has no index; run manitwin index"):
        publish_dataset(root, tmp_path / "out")
    index(root)
    make_twin(root, "a1")
    with pytest.raises(UsageError, match="lacks 1 finished"):
        publish_dataset(root, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("wrong", [{"shard_size_mb": 0}, {"shard_size_mb": 20_001}, {"twins_per_shard": 0}])
def test_senseless_bounds_are_refused(dataset: Path, tmp_path: Path, wrong: dict[str, int]) -> None:
    with pytest.raises(UsageError, match="give 1"):
        publish_dataset(dataset, tmp_path / "out", **wrong)


def test_from_one_url_to_another_gives_the_same_bytes(dataset: Path, published: Path) -> None:
    memory = fsspec.filesystem("memory")
    for name, content in files_below(dataset).items():
        memory.pipe_file(f"/from/{name}", content)
    try:
        with pytest.raises(KeyboardInterrupt):
            publish_dataset("memory://from", "memory://to/small-set", twins_per_shard=2, on_shard=stop_after(1))
        done = publish_dataset("memory://from", "memory://to/small-set", twins_per_shard=2)
        found = {path.removeprefix("/to/small-set/"): memory.cat_file(path) for path in memory.find("/to/small-set")}
    finally:
        memory.store.clear()
    assert done.kept_shards == 1
    assert found == files_below(published)
