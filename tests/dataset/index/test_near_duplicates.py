from pathlib import Path

import numpy as np
import pytest
import trimesh

from handmade import cup, hammer, mug
from manitwin.dataset.index import near_duplicates as module
from manitwin.dataset.index.near_duplicates import MAX_SHAPE_DISTANCE, NearDuplicates, near_duplicates
from manitwin.dataset.index.parts import write_part
from manitwin.dataset.index.query import Index
from manitwin.geometry.shape_descriptor import shape_descriptor
from manitwin.twin.dataset_root import DatasetRoot
from real_meshes import mesh_rows
from twin_folders import box, twin_id, write_accepted


def found_among(place: Path, meshes: list[trimesh.Trimesh], sources: list[bytes] | None = None) -> NearDuplicates:
    names = sources or [str(n).encode() for n in range(len(meshes))]
    ids = [write_accepted(place, n, mesh=m, source=s) for n, (m, s) in enumerate(zip(meshes, names, strict=True))]
    write_part(DatasetRoot(place), ids)
    return near_duplicates(Index(place))


def turned(mesh: trimesh.Trimesh, scale: float = 1.0) -> trimesh.Trimesh:
    copy = mesh.copy()
    copy.apply_transform(trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.5, 0.8])))
    return copy.apply_scale(scale).subdivide()


def test_same_shape_and_size_is_a_pair_and_another_size_or_shape_is_none(tmp_path: Path) -> None:
    found = found_among(tmp_path, [mug(), turned(mug(), 1.01), turned(mug(), 1.3), cup(), hammer(), box()])
    (pair,) = found.pairs
    assert {pair.first, pair.second} == {twin_id(0), twin_id(1)} and pair.first < pair.second
    assert pair.size_ratio == pytest.approx(1.01, abs=1e-4) and pair.shape_distance < 0.015
    assert found.same_source == {}


def test_twins_of_one_input_are_a_group_and_no_pair(tmp_path: Path) -> None:
    found = found_among(tmp_path, [mug(), mug(), hammer()], [b"one", b"one", b"two"])
    (group,) = found.same_source.values()
    assert group == sorted([twin_id(0), twin_id(1)]) and found.pairs == []


def test_tree_finds_what_comparing_all_pairs_finds() -> None:
    rng = np.random.default_rng(0)
    shapes = (rng.normal(size=(400, 3)) @ rng.normal(size=(3, 66)) * 0.01).astype(np.float32)
    log_sizes = rng.normal(scale=0.1, size=400)
    first, second, distance, ratio = module._near_pairs(shapes, log_sizes, 0.05, np.log(1.05))
    i, j = np.triu_indices(400, 1)
    apart = np.linalg.norm(shapes[i].astype(float) - shapes[j], axis=1)
    near = (apart <= 0.05) & (np.abs(log_sizes[i] - log_sizes[j]) <= np.log(1.05))
    assert set(zip(first.tolist(), second.tolist(), strict=True)) == set(
        zip(i[near].tolist(), j[near].tolist(), strict=True)
    )
    assert 50 < len(first) < 5000 and (np.diff(distance) >= 0).all() and (ratio >= 1).all()


def test_many_copies_give_few_pairs() -> None:
    first, *_ = module._near_pairs(np.zeros((1000, 66), np.float32), np.zeros(1000), 0.02, 0.05)
    assert len(first) <= 1000 * (module.NEIGHBOURS + 1)  # of equal ones, a twin's own row may be the one left out


def test_no_twins_give_no_pairs(tmp_path: Path) -> None:
    assert found_among(tmp_path, [mug()]).pairs == []


@pytest.mark.shared_data
def test_limit_lies_between_the_same_real_object_again_and_another(shared_data: Path) -> None:
    meshes = []
    for row in mesh_rows(shared_data).values():
        loaded = trimesh.load(shared_data / row["file"], skip_materials=True)
        meshes.append(loaded.to_mesh() if isinstance(loaded, trimesh.Scene) else loaded)
    first, again = (np.array([shape_descriptor(mesh, seed=seed).values for mesh in meshes]) for seed in (0, 1))
    apart = np.linalg.norm(first[:, None] - first, axis=2)[np.triu_indices(len(meshes), 1)]
    assert len(meshes) == 25
    assert np.linalg.norm(first - again, axis=1).max() < 0.75 * MAX_SHAPE_DISTANCE
    assert apart.min() > 2 * MAX_SHAPE_DISTANCE
