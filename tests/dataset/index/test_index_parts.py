import itertools
import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import fsspec
import pyarrow as pa
import pytest

from manitwin.dataset.index import parts
from manitwin.dataset.index.part_list import PARTS, read_part_list
from manitwin.dataset.index.parts import compact, indexed_twins, write_part
from manitwin.dataset.index.query import Index
from manitwin.dataset.index.rebuild import rebuild
from manitwin.dataset.index.tables import TABLES
from manitwin.errors import TwinError, UsageError
from manitwin.pipeline.stage_order import STAGE_ORDER
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from twin_folders import twin_id, write_accepted, write_rejected, write_set


def contents(root: DatasetRoot) -> dict[str, pa.Table]:
    index = Index(root)
    return {name: index.select(name) for name in TABLES}


def live_files(root: DatasetRoot) -> set[str]:
    found = read_part_list(root)
    assert found is not None
    return {PARTS, *(part.file(table) for part in found.parts for table in TABLES)}


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """A data set of six accepted and two rejected twins in three parts that overlap."""
    place = tmp_path_factory.mktemp("template")
    ids = write_set(place)
    for start in range(3):
        write_part(DatasetRoot(place), ids[start::3])
    return place, ids


@pytest.fixture
def written(template: tuple[Path, list[str]], tmp_path: Path) -> tuple[DatasetRoot, list[str]]:
    """A copy of the template for one test."""
    shutil.copytree(template[0], tmp_path, dirs_exist_ok=True)
    return DatasetRoot(tmp_path), template[1]


def test_every_twin_is_in_one_part_once(written: tuple[DatasetRoot, list[str]]) -> None:
    root, ids = written
    rows = contents(root)
    assert sorted(rows["twins"]["twin_id"].to_pylist() + rows["rejections"]["twin_id"].to_pylist()) == sorted(ids)
    assert rows["grasps"].num_rows == sum(8 + n for n in range(6))
    assert set(indexed_twins(root)) == set(ids)
    found = read_part_list(root)
    assert found is not None and len(found.parts) == 3


def test_rebuilt_index_equals_the_compacted_one(written: tuple[DatasetRoot, list[str]]) -> None:
    root, _ = written
    as_written = contents(root)
    (part,) = compact(root)
    compacted = contents(root)
    files = {table: root.read_bytes(part.file(table)) for table in TABLES}
    done = rebuild(root, jobs=2)
    assert done.unreadable == [] and len(done.parts) == 1
    assert as_written == compacted == contents(root)
    assert files == {table: root.read_bytes(done.parts[0].file(table)) for table in TABLES}


def test_twin_built_again_replaces_its_rows(written: tuple[DatasetRoot, list[str]], tmp_path: Path) -> None:
    root, ids = written
    write_accepted(tmp_path, 0, mass_kg=9.0, grasps=20, seed=1)
    write_rejected(tmp_path, 1, seed=1)
    write_accepted(tmp_path, 6, category="jar")  # rejected before
    write_part(root, [twin_id(0), twin_id(1), twin_id(6)])
    rows = contents(root)
    masses = dict(zip(rows["twins"]["twin_id"].to_pylist(), rows["twins"]["mass_kg"].to_pylist(), strict=True))
    assert masses[ids[0]] == 9.0 and ids[1] not in masses and ids[6] in masses
    assert set(rows["rejections"]["twin_id"].to_pylist()) == {ids[1], ids[7]}
    assert rows["grasps"].num_rows == 20 + sum(8 + n for n in range(2, 6)) + 8
    assert len(rows["stages"]) == 6 * len(STAGE_ORDER[3:]) + 2 * 3
    before = contents(root)
    rebuild(root, jobs=1)
    assert before == contents(root)


class PowerCut(Exception):
    pass


@pytest.mark.parametrize(
    "cut", [cut if cut in (0, 3, 6, 9, 12) else pytest.param(cut, marks=pytest.mark.slow) for cut in range(13)]
)
def test_cut_at_any_write_leaves_the_old_index_or_the_new(
    written: tuple[DatasetRoot, list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cut: int
) -> None:
    root, _ = written
    old = contents(root)
    write_accepted(tmp_path, 0, mass_kg=9.0, seed=1)  # its old part is written again: six files, six files, the list
    write, left = DatasetRoot.write_bytes, iter(range(cut + 1))

    def until_the_cut(self: DatasetRoot, name: str, content: bytes) -> None:
        if next(left) == cut:
            if self.local is not None:  # what a process leaves that dies while it writes
                (self.local / name).with_name(".half.1234").write_bytes(content[: len(content) // 2])
            raise PowerCut
        write(self, name, content)

    with monkeypatch.context() as patch:
        patch.setattr(DatasetRoot, "write_bytes", until_the_cut)
        with pytest.raises(PowerCut):
            write_part(root, [twin_id(0)])
    assert contents(root) == old
    write_part(root, [twin_id(0)])
    assert contents(root)["twins"].num_rows == 6 and contents(root) != old
    write_part(root, [])
    assert set(root.names_below("index")) == live_files(root)


def test_unreadable_twin_leaves_the_index_as_it_was(written: tuple[DatasetRoot, list[str]], tmp_path: Path) -> None:
    root, ids = written
    old = contents(root)
    (tmp_path / twin_name(ids[2]) / "visual.glb").unlink()
    with pytest.raises(TwinError, match=r"visual\.glb"):
        write_part(root, ids[:3])
    assert contents(root) == old
    done = rebuild(root, jobs=1)
    assert len(done.unreadable) == 1 and ids[2] in done.unreadable[0]
    assert set(indexed_twins(root)) == set(ids) - {ids[2]}


def test_eight_small_parts_become_one(tmp_path: Path) -> None:
    root = DatasetRoot(tmp_path)
    for number in range(9):
        write_rejected(tmp_path, number)
        write_part(root, [twin_id(number)])
        found = read_part_list(root)
        assert found is not None and found.rows("rejections") == number + 1
        assert len(found.parts) == (number + 1 if number < 7 else number - 6)


def test_large_index_is_cut_into_parts_that_do_not_overlap(
    written: tuple[DatasetRoot, list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    root, ids = written
    before = contents(root)
    monkeypatch.setattr(parts, "PART_ROWS", 20)
    found = compact(root)  # 63 grasps
    assert len(found) == 4 and sum(part.twins for part in found) == len(ids)
    assert all(one.last < other.first for one, other in itertools.pairwise(found))
    assert contents(root) == before
    assert compact(root) == found


def test_index_of_other_tables_asks_for_a_new_one(written: tuple[DatasetRoot, list[str]]) -> None:
    root, _ = written
    data = json.loads(root.read_bytes(PARTS))
    root.write_bytes(PARTS, json.dumps({**data, "schema_id": "older"}).encode())
    with pytest.raises(UsageError, match=r"another version.*run manitwin index"):
        Index(root).count()
    with pytest.raises(UsageError, match="another version"):
        write_part(root, [])
    rebuild(root, jobs=1)
    assert Index(root).count() == 6
    assert set(root.names_below("index")) == live_files(root)


def test_empty_data_set_has_an_empty_index(tmp_path: Path) -> None:
    (tmp_path / "twins").mkdir()  # as a build leaves it of which nothing has ended yet
    root = DatasetRoot(tmp_path)
    assert compact(root) == [] and indexed_twins(root) == {} and write_part(root, []) is None
    assert rebuild(root, jobs=1).parts == []
    assert Index(root).select("twins").schema == TABLES["twins"]


@pytest.fixture
def memory_root() -> Iterator[DatasetRoot]:
    files = fsspec.filesystem("memory")
    files.store.clear()
    yield DatasetRoot("memory://set")
    files.store.clear()


def test_index_behind_a_url_has_the_same_rows(
    written: tuple[DatasetRoot, list[str]], tmp_path: Path, memory_root: DatasetRoot
) -> None:
    root, ids = written
    for path in (tmp_path / "twins").rglob("*.*"):
        memory_root.write_bytes(path.relative_to(tmp_path).as_posix(), path.read_bytes())
    write_part(memory_root, ids[::2])
    write_part(memory_root, [ids[0], *ids[1::2]])
    assert contents(memory_root) == contents(root)
    compact(memory_root)
    assert contents(memory_root) == contents(root)
    assert set(memory_root.names_below("index")) == live_files(memory_root)
