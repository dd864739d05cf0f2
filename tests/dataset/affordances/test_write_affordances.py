"""Maps and parts of a small data set: what is written, read as training codes read it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from drawn_scenes import add_parts
from manitwin.dataset.affordances.maps import surface_maps
from manitwin.dataset.affordances.splits import split_twins, splits_of
from manitwin.dataset.affordances.write import write_affordances
from manitwin.dataset.catalog.groups import split_of
from manitwin.dataset.index.tables import DESCRIPTOR_LENGTH
from manitwin.errors import UsageError
from manitwin.geometry.shape_descriptor import ShapeDescriptor
from manitwin.robots import grippers
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import RECORD, write_twin_record
from scene_twins import BOWL_HEIGHT_M, BOWL_RADIUS_M, bowl, can, slab, write_thing
from twin_folders import tried_as_built, twin_id


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("set")
    for number, thing in enumerate((can(), slab("box", 0.05, 0.04, 0.08, 0.2))):
        _tried(root / twin_name(write_thing(root, number, thing)))
    add_parts(root / twin_name(twin_id(0)), ("base", "lid"))
    return root


def _tried(folder: Path) -> None:
    record = json.loads((folder / RECORD).read_bytes())
    record["grasps"]["trial"] = tried_as_built()
    del record["revision"], record["files"]
    write_twin_record(folder, record)


@pytest.fixture(scope="module")
def written(dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("out") / "affordances"
    done = write_affordances(dataset, out, points=400, trials=12)
    assert (done.twins, done.with_grasp_map, done.with_parts, done.left_out) == (2, 2, 1, {})
    assert done.median_similarity is not None and done.median_similarity > 0.3
    return out


def of(dataset: Path, written: Path, category: str) -> tuple[Twin, dict[str, np.ndarray]]:
    rows = json.loads((written / "affordances.json").read_text())["twins"]
    (row,) = (row for row in rows if row["category"] == category)
    with np.load(written / "maps" / f"{row['twin_id']}.npz", allow_pickle=False) as arrays:
        return Twin(dataset / twin_name(row["twin_id"])), dict(arrays)


@pytest.mark.parametrize("category", ["can", "box"])
def test_maps_lie_on_the_surface_and_are_in_affordance_nets_fields(dataset: Path, written: Path, category: str) -> None:
    twin, arrays = of(dataset, written, category)
    assert str(arrays["semantic_class"]) == category and str(arrays["shape_id"]) == twin.record.twin_id
    assert np.linalg.norm(arrays["coordinate"], axis=1).max() == pytest.approx(1, abs=1e-6)
    points_m = arrays["coordinate"] * arrays["scale_m"] + arrays["center_m"]
    (mesh,) = twin.visual
    assert trimesh.proximity.closest_point_naive(mesh, points_m)[1].max() < 1e-6
    assert arrays["label"].shape == (400, len(arrays["affordance"]))
    assert arrays["label"].min() >= 0 and (arrays["label"].max(0) > 0.99).all()
    assert (arrays["part"] == twin.face_parts()[arrays["face"]]).all()


def test_a_functional_map_is_largest_at_its_point(dataset: Path, written: Path) -> None:
    twin, arrays = of(dataset, written, "can")
    points_m = arrays["coordinate"] * arrays["scale_m"] + arrays["center_m"]
    assert twin.record.points is not None
    for point in twin.record.points.functional:
        label = arrays["label"][:, arrays["affordance"].tolist().index(f"function:{point.id} {point.label}")]
        nearest_m = np.linalg.norm(points_m - point.position_m, axis=1)
        assert nearest_m[label.argmax()] == nearest_m.min()


def test_an_opening_is_used_all_around_its_rim_inside_and_outside(tmp_path: Path) -> None:
    folder = tmp_path / twin_name(write_thing(tmp_path, 0, bowl()))
    record = json.loads((folder / RECORD).read_bytes())
    record["points"]["functional"][0] |= {
        "label": "opening", "position_m": [0.0, BOWL_RADIUS_M, BOWL_HEIGHT_M - 0.004], "normal": [0.0, 1.0, 0.0],
        "frame": {
            "position_m": [0.0, 0.0, BOWL_HEIGHT_M], "quaternion_wxyz": [1.0, 0.0, 0.0, 0.0], "kind": "opening",
            "size_m": BOWL_RADIUS_M - 0.005, "free": "roll", "source": "geometry",
        },
    }  # fmt: skip
    record["grasps"]["trial"] = tried_as_built()
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    maps = surface_maps(Twin(folder), points=1500, trials=1, seed=0)
    label = maps.maps["function:f0 opening"]
    radius_m = np.linalg.norm(maps.points_m[:, :2], axis=1)
    rim = (maps.points_m[:, 2] > BOWL_HEIGHT_M - 0.006) & (radius_m > BOWL_RADIUS_M - 0.012)
    assert rim.sum() > 50 and label[rim].min() > 0.5
    assert {bool(side) for side in radius_m[label > 0.9] > BOWL_RADIUS_M - 0.003} == {True, False}
    assert label[maps.points_m[:, 2] < 0.01].max() < 0.1  # the base and the floor are none of it


def test_fingers_of_80_mm_hold_a_slab_by_the_sides_that_they_span(dataset: Path, written: Path) -> None:
    _, arrays = of(dataset, written, "box")
    grasp = arrays["label"][:, arrays["affordance"].tolist().index("grasp")]
    by_side = {axis: grasp[np.abs(arrays["normal"][:, axis]) > 0.9].max() for axis in range(3)}
    assert max(by_side[0], by_side[1]) == 1 and by_side[2] < 0.95


def test_parts_are_rows_of_shapenetpart(dataset: Path, written: Path) -> None:
    twin, arrays = of(dataset, written, "can")
    parts = json.loads((written / "affordances.json").read_text())["parts"]
    rows = np.loadtxt(written / "parts" / "can" / f"{twin.record.twin_id}.txt")
    assert rows.shape == ((arrays["part"] != 255).sum(), 7) and parts == {"can/base": 0, "can/lid": 1}
    assert (rows[rows[:, 5] < -0.99][:, 6] == parts["can/base"]).all()
    assert (rows[rows[:, 5] > 0.99][:, 6] == parts["can/lid"]).all()
    lists = {
        path.stem: json.loads(path.read_text()) for path in (written / "parts" / "train_test_split").glob("*.json")
    }
    assert set(lists) == {f"shuffled_{split}_file_list" for split in ("train", "val", "test")}
    assert lists[f"shuffled_{split_of(twin.record.twin_id)}_file_list"] == [f"shape_data/can/{twin.record.twin_id}"]


def test_parts_are_read_by_the_toolkit_of_partnext(dataset: Path, written: Path) -> None:
    from partnext import PartNeXtDataset

    twin, _ = of(dataset, written, "can")
    read = PartNeXtDataset(str(written / "partnext" / "data"), str(written / "partnext" / "PartNeXt"))
    assert list(read.get_object_ids()) == [twin.record.twin_id]
    thing = read.load_object(twin.record.twin_id)
    (tree,) = thing.get_hierarchy()
    assert tree["name"] == "can" and [leaf["name"] for leaf in tree["children"]] == ["base", "lid"]
    parts = thing.get_all_parts()
    faces = np.concatenate([mesh.triangles for mesh in twin.visual])
    for leaf, part in zip(tree["children"], twin.record.parts, strict=True):
        found, known = parts[str(leaf["maskId"])], faces[twin.face_parts() == leaf["maskId"]]
        assert len(found.faces) == part.faces
        assert np.allclose(turned(found.triangles), known, atol=1e-6), "the same faces in the same order"


def turned(triangles: np.ndarray) -> np.ndarray:
    """Return triangles of glTF's frame, whose y is up, in the object's."""
    return np.stack([triangles[..., 0], -triangles[..., 2], triangles[..., 1]], -1)


def test_a_category_that_is_a_path_stays_below_the_folder(dataset: Path, tmp_path: Path) -> None:
    copied = tmp_path / "set"
    shutil.copytree(dataset, copied)
    folder = copied / twin_name(twin_id(0))
    record = json.loads((folder / RECORD).read_bytes())
    record["language"]["category"] = "../../../away/ca n"
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    write_affordances(copied, tmp_path / "deep" / "out", points=60, trials=3)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["deep", "set"]
    assert (tmp_path / "deep" / "out" / "parts" / "away_ca_n").is_dir()


def test_the_page_shows_the_twins_and_asks_for_nothing(written: Path) -> None:
    page = (written / "report.html").read_text()
    assert page.count("<img") == 2 and "2 twins of 2 categories, 1 with parts" in page
    assert "http" not in page and "<script" not in page


def test_same_arguments_give_the_same_bytes(dataset: Path, tmp_path: Path) -> None:
    for name in ("one", "other"):
        write_affordances(dataset, tmp_path / name, points=60, trials=3, seed=4)
    for path in sorted(path for path in (tmp_path / "one").rglob("*") if path.is_file()):
        assert path.read_bytes() == (tmp_path / "other" / path.relative_to(tmp_path / "one")).read_bytes(), path.name


def test_splits_have_their_shares() -> None:
    found = [split_of(f"{number:016x}") for number in range(2000)]
    assert found.count("train") == pytest.approx(1600, abs=80) and found.count("test") == pytest.approx(200, abs=50)


def test_what_cannot_be_written_leaves_nothing(dataset: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(UsageError, match="no accepted twin"):
        write_affordances(tmp_path / "empty", tmp_path / "out")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").write_text("x")
    with pytest.raises(UsageError, match="not empty"):
        write_affordances(dataset, tmp_path / "full", points=64, trials=2)
    assert not (tmp_path / "out").exists() and [p.name for p in (tmp_path / "full").iterdir()] == ["mine"]


def test_a_twin_whose_trial_cannot_be_repeated_is_left_out_with_the_reason(tmp_path: Path) -> None:
    identity = write_thing(tmp_path / "set", 0, can())  # its record is made, and says a trial of no force
    done = write_affordances(tmp_path / "set", tmp_path / "out", points=60, trials=3)
    assert done.twins == 0 and "grasps.trial.force_n" in done.left_out[identity]
    assert "\n" not in done.left_out[identity]


def test_maps_are_of_the_first_gripper_with_parallel_jaws(tmp_path: Path) -> None:
    """A cup comes first in one twin, and is all that there is in the other."""
    both, cup_alone = (write_thing(tmp_path / "set", number, can()) for number in range(2))
    for identity in (both, cup_alone):
        folder = tmp_path / "set" / twin_name(identity)
        record = json.loads((folder / RECORD).read_bytes())
        jaws = record["grasps"] | {"trial": tried_as_built()}
        summary = {"summary": jaws, "reason": None, "detail": None, "transferable": 0, "transferred": 0}
        record["grasps"] |= {"gripper": "suction"}
        record["grasps"]["other_grippers"] = {jaws["gripper"]: summary} if identity == both else {}
        del record["revision"], record["files"]
        write_twin_record(folder, record)
    done = write_affordances(tmp_path / "set", tmp_path / "out", points=200, trials=12)
    assert (done.twins, done.with_grasp_map) == (1, 1) and list(done.left_out) == [cup_alone]
    assert "suction has no parallel jaws" in done.left_out[cup_alone]


def test_maps_of_a_gripper_of_ones_own_are_made_with_its_file(tmp_path: Path) -> None:
    identity = write_thing(tmp_path / "set", 0, can())
    folder = tmp_path / "set" / twin_name(identity)
    panda = Path(grippers.__file__).parent / "definitions" / "panda.toml"
    (tmp_path / "mine.toml").write_text(panda.read_text().replace('name = "panda"', 'name = "mine"'))
    mine = load_gripper(str(tmp_path / "mine.toml"))
    record = json.loads((folder / RECORD).read_bytes())
    record["grasps"] |= {"trial": tried_as_built(), "gripper": "mine", "gripper_sha256": mine.sha256}
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    without = write_affordances(tmp_path / "set", tmp_path / "without", points=60, trials=3)
    assert "give its file with --gripper" in without.left_out[identity]
    done = write_affordances(tmp_path / "set", tmp_path / "out", points=200, trials=12, grippers=[mine])
    assert (done.twins, done.left_out) == (1, {})


def test_copies_are_in_one_split() -> None:
    def shape(number: float) -> ShapeDescriptor:
        return ShapeDescriptor(np.full(DESCRIPTOR_LENGTH, number, np.float32), 0.05)

    # ten inputs, each built four times; of each further input the shape is that of another with a larger id
    built = {f"{number:02d}": (f"input {number % 10}", shape(float(number % 10))) for number in range(40)}
    alike = {f"x{number}": (f"copy {number}", shape(float(number))) for number in range(10)}
    both = built | alike
    splits = splits_of({k: v for k, (_, v) in both.items()}, {k: source for k, (source, _) in both.items()})
    assert splits.keys() == both.keys()
    for number in range(10):
        copies = [f"{each:02d}" for each in range(number, 40, 10)]
        assert {splits[each] for each in (*copies, f"x{number}")} == {split_of(copies[0])}
    assert len(set(splits.values())) > 1


def test_a_twin_whose_shape_is_damaged_is_left_out_with_the_reason(dataset: Path, tmp_path: Path) -> None:
    shutil.copytree(dataset, tmp_path / "set")
    twins = [Twin(path.parent) for path in sorted((tmp_path / "set").rglob("twin.json"))]
    damaged = next(twin for twin in twins if twin.record.status == "accepted")
    (damaged.folder / "shape.json").write_text("{")
    splits, left_out = split_twins(twins)
    assert set(left_out) == {damaged.record.twin_id} and "shape.json" in left_out[damaged.record.twin_id]
    assert damaged.record.twin_id not in splits
