import hashlib
import importlib.util
import pickle
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import fsspec
import numpy as np
import pytest

import manitwin
from manitwin.dataset.index.dataset import Dataset
from manitwin.dataset.index.part_list import read_part_list
from manitwin.dataset.index.parts import write_part
from manitwin.dataset.index.tables import TABLES
from manitwin.errors import TwinError, UsageError
from manitwin.geometry.distance import distance_to_surface
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.twin.dataset_root import DatasetRoot
from twin_folders import box, grasp_table, twin_id, write_accepted, write_set


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("set")
    write_part(DatasetRoot(place), write_set(place))
    return place


@pytest.fixture
def dataset(place: Path) -> Dataset:
    return manitwin.Dataset(place)


def test_nothing_is_read_before_it_is_asked_for(tmp_path: Path) -> None:
    lazy = Dataset(tmp_path / "not there").filter("nonsense").split().train
    with pytest.raises(UsageError, match="not a data set"):
        len(lazy)


def test_filters_add_up(dataset: Dataset) -> None:
    mugs = dataset.filter("category = 'mug'")
    assert len(dataset) == 6 and len(mugs) == 2
    assert mugs.filter("mass_kg < 0.3").ids() == [twin_id(0)]
    assert sorted(dataset.ids()) == dataset.ids()
    assert "category = 'mug'" in repr(mugs)
    with pytest.raises(UsageError, match="not a single condition"):
        len(dataset.filter("true FROM twins"))
    with pytest.raises(UsageError, match="syntax error"):
        dataset.filter("true) OR (true").grasps()


def test_ids_records_and_twins_agree(dataset: Dataset) -> None:
    ids = dataset.ids()
    assert [record.twin_id for record in dataset.records()] == ids
    assert [twin.record.twin_id for twin in dataset] == ids
    assert dataset.twins()[0].visual[0].extents == pytest.approx(next(dataset.records()).physical.extents_m, abs=1e-6)


def test_it_is_a_sequence_in_the_order_of_ids(dataset: Dataset) -> None:
    ids = dataset.ids()
    assert isinstance(dataset, Sequence) and len(dataset) == 6
    assert [dataset[place].record.twin_id for place in (0, 5, -1, -6)] == [ids[0], ids[5], ids[5], ids[0]]
    assert dataset[np.int64(2)].record.twin_id == ids[2]
    assert [twin.record.twin_id for twin in reversed(dataset)] == ids[::-1]
    assert ids[3] in dataset and dataset[3] in dataset and "no such twin" not in dataset and None not in dataset
    assert dataset.index(dataset[4]) == dataset.index(ids[4]) == 4 and dataset.count(ids[4]) == 1
    with pytest.raises(ValueError):
        dataset.index(ids[4], 5)
    for place in (6, -7):
        with pytest.raises(IndexError, match=rf"no twin {place} of 6; give -6 to 5"):
            dataset[place]
    with pytest.raises(IndexError, match="there are none"):
        dataset.filter("mass_kg > 100")[0]


def test_a_twin_is_had_by_its_id_where_it_is_among_these(dataset: Dataset) -> None:
    ids = dataset.ids()
    assert dataset[ids[2]].record.twin_id == dataset[1:][ids[2]].record.twin_id == ids[2]
    with pytest.raises(KeyError, match=f"no twin {ids[0]} among these {len(ids) - 1}"):
        dataset[1:][ids[0]]


def test_slices_are_sequences_of_the_same_twins(dataset: Dataset) -> None:
    ids = dataset.ids()
    for part in (slice(1, 4), slice(None, None, -2), slice(-2, None), slice(10, 20), slice(4, 1)):
        assert dataset[part].ids() == ids[part] and len(dataset[part]) == len(ids[part])
        assert [twin.record.twin_id for twin in dataset[part]] == ids[part]
    assert dataset[1:][1:][0].record.twin_id == ids[2]
    assert isinstance(dataset[1:], Sequence) and ids[0] not in dataset[1:]
    mugs = dataset.filter("category = 'mug'")
    assert mugs[1:].ids() == mugs.ids()[1:]


def test_a_twin_is_read_when_it_is_asked_for(tmp_path: Path) -> None:
    write_part(DatasetRoot(tmp_path), write_set(tmp_path))
    dataset = Dataset(tmp_path)
    first, second, *_ = dataset.ids()
    for folder in (tmp_path / "twins").glob("*/*"):
        if folder.name != second:
            shutil.rmtree(folder)
    rest = dataset[::2]
    assert len(rest) == 3 and repr(rest).startswith(f"Twins({str(tmp_path)!r}, 3: {first}")
    assert dataset[1].record.twin_id == second
    with pytest.raises(TwinError, match=first):
        dataset[0]


def test_places_follow_the_index_once_it_is_read_anew(tmp_path: Path) -> None:
    root = DatasetRoot(tmp_path)
    write_part(root, write_set(tmp_path))
    dataset = Dataset(tmp_path)
    before = dataset.ids()
    old = read_part_list(root)
    write_part(root, [*before, write_accepted(tmp_path, 50)])
    assert dataset.ids() == before and old is not None  # the index is as it was when it was first asked
    for table in TABLES:
        root.remove(old.parts[0].file(table))  # as the next write does
    assert len(dataset) == 7
    assert dataset.ids() == sorted([*before, twin_id(50)]) == Dataset(tmp_path).ids()
    assert dataset[dataset.index(twin_id(50))].record.twin_id == twin_id(50)


def test_tables_hold_the_filtered_twins_alone(dataset: Dataset) -> None:
    heavy = dataset.filter("mass_kg > 0.45")
    assert heavy.table(["category", "mass_kg"]).to_pydict()["mass_kg"] == pytest.approx(
        [{twin_id(4): 0.5, twin_id(5): 0.6}[each] for each in heavy.ids()]
    )
    assert heavy.grasps().num_rows == 12 + 13
    held = heavy.grasps("verified and proposer = 'antipodal'", ["twin_id", "grasp_id"])
    expected = {twin_id(n): len(held_poses(n)) for n in (4, 5)}
    assert {each: held["twin_id"].to_pylist().count(each) for each in expected} == expected


def test_split_follows_the_hash_of_seed_and_source(dataset: Dataset) -> None:
    sources = dict(zip(dataset.ids(), dataset.table(["source_sha256"])["source_sha256"].to_pylist(), strict=True))
    for seed in range(5):
        parts = dataset.split(0.5, 0.25, 0.25, seed=seed)
        found = {each: name for name in ("train", "val", "test") for each in getattr(parts, name).ids()}
        for each, source in sources.items():
            share = int(hashlib.sha256(f"{seed}:{source}".encode()).hexdigest()[:16], 16) / 2**64
            assert found[each] == ("train" if share < 0.5 else "val" if share < 0.75 else "test")
        assert len(found) == 6 == sum(map(len, parts))


def test_split_keeps_copies_together_and_stays_when_the_set_grows(tmp_path: Path) -> None:
    def written(numbers: range) -> dict[str, str]:
        # every input is there twice, as twins of two names would be
        ids = [write_accepted(tmp_path, n, mesh=box(), source=f"input {n // 2}".encode()) for n in numbers]
        write_part(DatasetRoot(tmp_path), ids)
        parts = Dataset(tmp_path).split(seed=3)
        return {each: name for name, part in parts._asdict().items() for each in part.ids()}

    few, many = written(range(20)), written(range(20, 60))
    assert few.items() <= many.items() and len(many) == 60
    assert all(many[twin_id(n)] == many[twin_id(n + 1)] for n in range(0, 60, 2))
    assert set(many.values()) == {"train", "val", "test"}


@pytest.mark.parametrize("shares", [(0.8, 0.2, 0.1), (-0.1, 0.5, 0.5)])
def test_split_refuses_shares_that_are_none(dataset: Dataset, shares: tuple[float, float, float]) -> None:
    with pytest.raises(UsageError, match="add up to at most 1"):
        dataset.split(*shares)


def test_split_of_everything_takes_everything(dataset: Dataset) -> None:
    assert [len(part) for part in dataset.split(1, 0, 0)] == [6, 0, 0]
    assert [len(part) for part in dataset.split(0, 0, 0)] == [0, 0, 0]


def test_batch_holds_points_of_the_surface_and_grasps_of_the_twin(dataset: Dataset) -> None:
    batches = list(dataset.batches(4, points=100, grasps=6, seed=1))
    assert [batch["points"].shape for batch in batches] == [(4, 100, 3), (2, 100, 3)]
    assert [batch["grasps"].shape for batch in batches] == [(4, 6, 4, 4), (2, 6, 4, 4)]
    assert sorted(each for batch in batches for each in batch["twin_ids"]) == dataset.ids()
    by_id = {twin_id(n): n for n in range(6)}
    for batch in batches:
        for i, each in enumerate(batch["twin_ids"]):
            number = by_id[each]
            mesh = box(0.03 + 0.01 * number)
            assert distance_to_surface(batch["points"][i].astype(float), mesh).max() < 1e-6
            poses = held_poses(number)
            assert batch["mask"][i].sum() == len(poses) == batch["verified"][i].sum()
            assert batch["grasps"][i][: len(poses)] == pytest.approx(poses, abs=1e-6)
            assert (batch["grasps"][i][len(poses) :] == np.eye(4)).all()


def held_poses(number: int) -> np.ndarray:
    """The twin's grasps that held, in the order of its file, without the unfiltered and the jittered one."""
    rows = grasp_table(number, 8 + number).to_pylist()[:-2]
    held = [row for row in rows if row["verified"]]
    turns = rotation_from_quaternion_wxyz(np.array([row["quaternion_wxyz"] for row in held]))
    return np.array([transform(turn, np.array(row["position_m"])) for turn, row in zip(turns, held, strict=True)])


def test_batch_with_failed_grasps_says_which_held(dataset: Dataset) -> None:
    (batch,) = dataset.filter("category = 'can'").batches(8, points=10, grasps=20, verified_only=False)
    for each, mask, verified in zip(batch["twin_ids"], batch["mask"], batch["verified"], strict=True):
        number = {twin_id(n): n for n in (2, 5)}[each]
        assert mask.sum() == 6 + number and verified.sum() == len(held_poses(number))
        assert not verified[~mask].any()


def test_twin_draws_the_same_whatever_the_batch(dataset: Dataset) -> None:
    def drawn(size: int, seed: int) -> dict[str, tuple[bytes, bytes]]:
        batches = dataset.batches(size, points=50, grasps=2, seed=seed)
        return {
            each: (batch["points"][i].tobytes(), batch["grasps"][i].tobytes())
            for batch in batches
            for i, each in enumerate(batch["twin_ids"])
        }

    assert drawn(1, 0) == drawn(4, 0)
    assert all(drawn(4, 0)[each] != drawn(4, 1)[each] for each in dataset.ids())
    orders = [
        [each for batch in dataset.batches(2, points=1, seed=seed) for each in batch["twin_ids"]] for seed in (0, 0, 1)
    ]
    assert orders[0] == orders[1] != orders[2]


def test_twin_without_grasps_has_an_empty_mask(tmp_path: Path) -> None:
    write_part(DatasetRoot(tmp_path), [write_accepted(tmp_path, 1, grasps=2)])  # an unfiltered and a jittered one
    (batch,) = Dataset(tmp_path).batches(1, points=5, grasps=3)
    assert not batch["mask"].any() and (batch["grasps"] == np.eye(4)).all()
    assert list(Dataset(tmp_path).filter("false").batches(2)) == []


def test_batches_refuse_what_they_cannot_make(dataset: Dataset) -> None:
    with pytest.raises(UsageError, match="size is 0"):
        dataset.batches(0)
    with pytest.raises(UsageError, match="unknown framework 'tensorflow'"):
        dataset.batches(1, framework="tensorflow")  # type: ignore[arg-type]


@pytest.mark.skipif(importlib.util.find_spec("torch") is not None, reason="PyTorch is installed")
def test_torch_that_is_not_installed_is_said_at_once(dataset: Dataset) -> None:
    with pytest.raises(UsageError, match="PyTorch is not installed"):
        dataset.batches(1, framework="torch")


def test_torch_batches_hold_the_same_numbers(dataset: Dataset) -> None:
    pytest.importorskip("torch")
    (arrays,), (tensors,) = (list(dataset.batches(6, points=9, framework=each)) for each in ("numpy", "torch"))
    for name in ("points", "grasps", "mask", "verified"):
        assert (tensors[name].numpy() == arrays[name]).all()


def test_dataset_travels_to_another_process(dataset: Dataset) -> None:
    mugs = dataset.filter("category = 'mug'")
    assert len(mugs) == 2
    assert pickle.loads(pickle.dumps(mugs)).ids() == mugs.ids()


def test_dataset_behind_a_url_reads_the_same(dataset: Dataset, place: Path) -> None:
    root = DatasetRoot("memory://read")
    for path in place.rglob("*.*"):
        root.write_bytes(path.relative_to(place).as_posix(), path.read_bytes())
    remote = Dataset("memory://read").filter("category = 'mug'")
    local = dataset.filter("category = 'mug'")
    assert list(remote.records()) == list(local.records())
    twins = list(remote)
    assert [len(twin.grasps()) for twin in twins] == [len(twin.grasps()) for twin in local]
    folder = twins[0].folder
    assert folder.is_dir()
    del twins
    assert not folder.exists()
    (one,), (other,) = (each.batches(2, points=20, grasps=3) for each in (remote, local))
    assert all((one[name] == other[name]).all() for name in ("points", "grasps", "mask", "verified"))
    fsspec.filesystem("memory").rm("/read", recursive=True)


def test_package_imports_without_tables() -> None:
    code = (
        "import sys, manitwin; print([m for m in ('duckdb', 'pyarrow', 'numpy') if m in sys.modules], manitwin.Dataset)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[] <class 'manitwin.dataset.index.dataset.Dataset'>"
