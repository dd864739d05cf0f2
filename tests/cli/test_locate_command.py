"""``manitwin locate`` on the command line: a box on a floor, seen by a noisy camera."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from json_documents import check_keys
from manitwin.cli.main import app
from manitwin.dataset.index.rebuild import rebuild
from manitwin.dataset.search import appearance_vectors
from manitwin.errors import UsageError
from manitwin.formats.label_picture import label_picture
from manitwin.geometry.poses import inverse, rotation_from_quaternion_wxyz, transform, transform_points
from manitwin.scenes.loaded_scene import object_pose
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.scene_files import read_scene
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.loaded_twin import Twin
from scene_twins import can, slab, write_thing
from seen_solids import Seen, seen_from


@dataclass(frozen=True)
class Files:
    """Two twins, and the options of a picture that shows the first."""

    box: Path
    can: Path
    view: tuple[str, ...]
    seen: Seen
    model: PoseModel


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    root = tmp_path_factory.mktemp("located")
    names = [write_thing(root, n, thing) for n, thing in enumerate((slab("box", 0.14, 0.09, 0.05, 0.3), can()))]
    box, other = (root / twin_name(name) for name in names)
    model = PoseModel.of_twin(Twin(box))
    seen = seen_from(model, 0.5, table=True)
    pictures = {"depth": seen.view.depth_m * 1000, "mask": seen.mask * 255}
    for name, numbers in pictures.items():
        (root / f"{name}.png").write_bytes(label_picture(np.rint(numbers)))
    Image.fromarray(np.full((240, 240, 3), 120, np.uint8)).save(root / "rgb.png")
    camera = {"K": seen.view.intrinsics.tolist(), "pixel_centers_at": 0.5, "width": 240, "height": 240}
    (root / "camera.json").write_text(json.dumps({**camera, "depth_unit_m": 0.001}))
    view = tuple(
        str(each)
        for name, file in (("depth", "depth.png"), ("mask", "mask.png"), ("rgb", "rgb.png"), ("camera", "camera.json"))
        for each in (f"--{name}", root / file)
    )
    return Files(box, other, view, seen, model)


def run(*arguments: object) -> tuple[int, str]:
    done = CliRunner().invoke(app, ["locate", *map(str, arguments)])
    return done.exit_code, done.stdout if done.exception is None or done.exit_code else str(done.exception)


def test_a_box_is_found_and_what_was_decided_is_written(files: Files, tmp_path: Path) -> None:
    code, said = run(files.box, *files.view, "--out", tmp_path / "place", "--json")
    told = json.loads(said)
    check_keys(told, "locate")
    assert code == 0 and told["status"] == "found"
    pose = told["poses"][0]
    found = transform(rotation_from_quaternion_wxyz(np.array(pose["quaternion_wxyz"])), np.array(pose["position_m"]))
    corner = files.model.points[::500]
    same = [transform_points(found @ turn, corner) for turn in files.model.symmetry_poses]
    true = transform_points(files.seen.object_to_camera, corner)
    assert min(np.linalg.norm(each - true, axis=1).max() for each in same) < 0.006
    assert json.loads((tmp_path / "place" / "location.json").read_text()) == told
    overlay = np.asarray(Image.open(tmp_path / "place" / "overlay_0.png"))
    assert overlay.shape == (480, 960, 3)
    green = overlay[:, 480:, 1].astype(int) - overlay[:, 480:, 0] > 20
    assert 0.1 < green.mean() < 0.6, "the box is tinted"


def test_without_a_mask_the_box_is_what_stands_above_the_largest_plane(files: Files) -> None:
    code, said = run(files.box, *(word for word in without(files.view, "--mask")), "--json")
    assert code == 0
    x, y, width, height = json.loads(said)["box"]
    rows, columns = np.nonzero(files.seen.mask)
    wanted = (columns.min(), rows.min(), np.ptp(columns), np.ptp(rows))
    assert np.abs(np.subtract((x, y, width, height), wanted)).max() <= 6


@pytest.mark.slow
def test_which_twin_it_is_is_told_by_looks_and_decided_by_the_score(
    files: Files, monkeypatch: pytest.MonkeyPatch
) -> None:
    rebuild(DatasetRoot(files.box.parents[2]), jobs=1)
    monkeypatch.setattr(appearance_vectors, "AROUND", 2)
    code, said = run(files.box.parents[2], *files.view, "--json")
    told = json.loads(said)
    check_keys(told, "locate DATASET")
    (thing,) = told["things"]
    assert code == 0 and thing["twin_id"] == files.box.name and thing["status"] == "found"
    assert [each["twin_id"] for each in thing["tried"]] == [files.box.name, files.can.name]
    assert thing["tried"][1]["score"] < thing["least_score"] <= thing["tried"][0]["score"]


def test_grasps_at_the_pose_add_up_and_a_cloud_has_none(files: Files) -> None:
    code, said = run(files.box, *files.view, "--grasps", "--json")
    told = json.loads(said)
    check_keys(told, "locate")
    grasps = told["grasps"]
    assert code == 0 and grasps["verified"] == len(Twin(files.box).grasps())
    assert grasps["verified"] == len(grasps["free"]) + grasps["obstructed"] + grasps["uncertain"]
    done = CliRunner().invoke(app, ["locate", str(files.box), "--cloud", str(files.box / "grasps.parquet"), "--grasps"])
    assert "does not show its surroundings" in str(done.exception)


def test_what_an_estimator_guesses_is_checked_and_says_who_guessed(files: Files) -> None:
    program = f"command:{sys.executable} -m manitwin.models.fakes.pose_estimator {{request}} {{out}}"
    code, said = run(files.box, *files.view, "--estimator", program, "--json")
    told = json.loads(said)
    check_keys(told, "locate")
    assert code == 0 and told["estimator"] == "rehearsal" and told["status"] == "found"
    assert run(files.can, *files.view, "--estimator", program)[0] == 3


def test_the_scene_is_written_as_a_layout_in_the_robots_world(files: Files, tmp_path: Path) -> None:
    object_to_base = transform(None, np.array([0.45, 0.0, 0.0]))
    camera_to_base = object_to_base @ inverse(files.seen.object_to_camera)
    (tmp_path / "base.json").write_text(json.dumps({"camera_to_base": camera_to_base.tolist()}))
    options = (*files.view, "--base", tmp_path / "base.json", "--out", tmp_path / "place")
    code, said = run(files.box, *options, "--robot", "panda", "--json")
    told = json.loads(said)
    check_keys(told, "locate")
    assert code == 0 and told["layout"]["base"] == "given" and told["layout"]["reason"] == ""
    scene = read_scene(tmp_path / "place" / told["layout"]["scene"])
    (middle,) = transform_points(object_pose(scene.objects[0]), np.array([[0, 0, 0.025]]))
    assert middle == pytest.approx([0.45, 0, 0.025], abs=0.006), "on either face: the box looks the same"
    assert scene.robot == "panda"
    assert told["grasps"]["robot"] == "panda" and told["grasps"]["reached"] <= len(told["grasps"]["free"])


def without(words: tuple[str, ...], option: str) -> tuple[str, ...]:
    place = words.index(option)
    return words[:place] + words[place + 2 :]


def test_another_twin_is_refused_with_status_3(files: Files) -> None:
    code, said = run(files.can, *files.view)
    assert code == 3 and said.startswith("not thing: its best pose explains")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((), "--depth, --camera: missing"),
        (("--depth", "depth.png"), "--camera: missing"),
        (("--depth", "depth.png", "--cloud", "camera.json"), "cannot be combined with"),
        (("--cloud", "camera.json"), "is not a point cloud"),
        (("--cloud", "camera.json", "--base", "camera.json"), "--base: a point cloud of the object alone"),
        (("--depth", "depth.png", "--camera", "camera.json", "--base", "camera.json"), "contains no camera pose"),
    ],
)
def test_what_cannot_be_asked_is_refused(files: Files, given: tuple[str, ...], said: str) -> None:
    root = Path(files.view[1]).parent
    words = [word if word.startswith("--") else root / word for word in given]
    done = CliRunner().invoke(app, ["locate", str(files.box), *map(str, words)])
    assert said in str(done.exception) and done.exit_code == 1


@pytest.mark.slow
def test_a_twin_of_another_size_is_found_at_the_things_size_and_gives_no_grasps(files: Files, tmp_path: Path) -> None:
    small = tmp_path / twin_name(write_thing(tmp_path, 5, slab("box", 0.14 / 1.3, 0.09 / 1.3, 0.05 / 1.3, 0.3)))
    code, said = run(small, *files.view, "--json")
    assert code == 3 and json.loads(said)["size"] is None
    code, said = run(small, *files.view, "--fit-size", "--grasps", "--out", tmp_path / "place", "--json")
    told = json.loads(said)
    assert code == 0 and told["size"]["factor"] == pytest.approx(1.3, rel=0.03)
    assert told["size"]["low"] <= told["size"]["factor"] <= told["size"]["high"]
    assert told["grasps"] is None and told["placements"] == []
    assert told["layout"]["scene"] is None and "another size" in told["layout"]["reason"]


def test_a_size_is_looked_for_of_one_twin_by_the_own_search(files: Files) -> None:
    for words in ((files.box.parents[2],), (files.box, "--estimator", "command:true {request} {out}")):
        done = CliRunner().invoke(app, ["locate", *map(str, words), *files.view, "--fit-size"])
        assert isinstance(done.exception, UsageError) and "give a twin, and leave out --estimator" in str(
            done.exception
        )
