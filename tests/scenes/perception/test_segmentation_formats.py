"""Each format, read by its own reader or by the definitions of its layout, against the pictures of ids and the meshes."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from manitwin.errors import UsageError
from manitwin.geometry.poses import inverse, transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.scenes.perception.bop_models import BopModel
from manitwin.scenes.perception.classes import Classes
from manitwin.scenes.perception.scene_truth import SceneTruth
from manitwin.scenes.perception.segmentation import FORMATS, write_segmentation
from manitwin.twin.dataset_root import twin_name
from scene_twins import slab, write_thing
from twin_folders import twin_id

# pycocotools 2.0.11 returns arrays in NumPy 1's way
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")


@pytest.fixture(scope="module")
def written(scenes: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All formats, each in the folder of its name; no scene is kept for validation."""
    out = tmp_path_factory.mktemp("formats")
    for form in FORMATS:
        done = write_segmentation(scenes, out / form, form, validation_share=0)
        files = [path for path in (out / form).rglob("*") if path.is_file()]
        assert (done.scenes, done.pictures, done.categories, done.part_kinds) == (2, 4, 3, 2)
        assert done.files == len(files)
    return out


def pictures_of(truths: list[SceneTruth]) -> dict[str, tuple[SceneTruth, int]]:
    return {
        f"{truth.record.scene_id}_{picture.name}": (truth, place)
        for truth in truths
        for place, picture in enumerate(truth.pictures)
    }


@pytest.mark.parametrize("kind", ["instances", "parts"])
def test_coco_against_itself_has_an_average_precision_of_one(
    written: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    truth = COCO(str(written / "coco" / "annotations" / f"{kind}_train.json"))
    found = [{**annotation, "score": 0.9} for annotation in truth.loadAnns(truth.getAnnIds())]
    judged = COCOeval(truth, truth.loadRes(found), "segm")
    judged.evaluate()
    judged.accumulate()
    judged.summarize()
    capsys.readouterr()
    assert judged.stats[0] == 1.0


def test_coco_masks_are_the_pictures_of_ids_to_the_pixel(written: Path, truths: list[SceneTruth]) -> None:
    coco, pictures = COCO(str(written / "coco" / "annotations" / "instances_train.json")), pictures_of(truths)
    masks = 0
    for image in coco.loadImgs(coco.getImgIds()):
        truth, place = pictures[image["file_name"].removesuffix(".jpg")]
        ids, covered = truth.pictures[place].ids, np.zeros_like(truth.pictures[place].ids, bool)
        for annotation in coco.loadAnns(coco.getAnnIds(imgIds=image["id"])):
            mask = coco.annToMask(annotation).astype(bool)
            assert (mask == (ids == truth.ids[annotation["object"]])).all() and annotation["area"] == mask.sum()
            rows, columns = np.nonzero(mask)
            x, y, width, height = annotation["bbox"]
            assert (x, y, x + width - 1, y + height - 1) == (columns.min(), rows.min(), columns.max(), rows.max())
            covered |= mask
            masks += 1
        objects = [truth.ids[thing.name] for thing in truth.record.objects]
        assert (covered == np.isin(ids, objects)).all(), "what is seen has an annotation"
        colors = cv2.imread(str(written / "coco" / "images" / image["file_name"]))
        assert np.abs(colors[..., ::-1].astype(int) - truth.pictures[place].rgb).mean() < 3
    assert masks >= 11


def test_parts_lie_within_their_objects(written: Path) -> None:
    folder = written / "coco" / "annotations"
    instances, parts = COCO(str(folder / "instances_train.json")), COCO(str(folder / "parts_train.json"))
    assert {each["name"] for each in parts.loadCats(parts.getCatIds())} == {"can/base", "can/lid"}
    for part in parts.loadAnns(parts.getAnnIds()):
        (owner,) = instances.loadAnns([part["instance_id"]])
        assert owner["image_id"] == part["image_id"]
        assert not (parts.annToMask(part) & ~instances.annToMask(owner)).any()


def panoptic(written: Path) -> tuple[dict[str, np.ndarray], dict[str, list[dict[str, int]]], dict[int, int]]:
    said = json.loads((written / "coco-panoptic" / "annotations" / "panoptic_train.json").read_text())
    pictures, segments = {}, {}
    for annotation in said["annotations"]:
        image = cv2.imread(str(written / "coco-panoptic" / "panoptic_train" / annotation["file_name"])).astype(int)
        pictures[annotation["file_name"]] = image[..., 2] + 256 * image[..., 1] + 65536 * image[..., 0]
        segments[annotation["file_name"]] = annotation["segments_info"]
    return pictures, segments, {each["id"]: each["isthing"] for each in said["categories"]}


def test_panoptic_truth_against_itself_has_a_quality_of_one(written: Path) -> None:
    pictures, segments, _ = panoptic(written)
    for name, picture in pictures.items():
        matched = total_iou = 0.0
        for truth in segments[name]:
            for found in segments[name]:
                if truth["category_id"] != found["category_id"]:
                    continue
                one, other = picture == truth["id"], picture == found["id"]
                iou = (one & other).sum() / (one | other).sum()
                if iou > 0.5:  # Kirillov et al., "Panoptic Segmentation": each segment matches one at most
                    matched, total_iou = matched + 1, total_iou + iou
        assert total_iou / (0.5 * len(segments[name]) + 0.5 * len(segments[name])) == 1 and matched == len(
            segments[name]
        )
        assert sum(segment["area"] for segment in segments[name]) == picture.size, "no pixel is void or counted twice"
        assert set(np.unique(picture)) == {segment["id"] for segment in segments[name]}


def test_panoptic_things_are_the_objects_and_the_rest_is_stuff(written: Path, truths: list[SceneTruth]) -> None:
    pictures, segments, is_thing = panoptic(written)
    for name, picture in pictures.items():
        truth, place = pictures_of(truths)[name.removesuffix(".png")]
        objects = {truth.ids[thing.name] for thing in truth.record.objects}
        for segment in segments[name]:
            under = set(np.unique(truth.pictures[place].ids[picture == segment["id"]]))
            assert under == {segment["id"]} if is_thing[segment["category_id"]] else not under & objects


def test_cityscapes_instances_are_labels_and_numbers(written: Path, truths: list[SceneTruth]) -> None:
    names = json.loads((written / "cityscapes" / "labels.json").read_text())
    for name, (truth, place) in pictures_of(truths).items():
        folder = written / "cityscapes" / "gtFine" / "train" / truth.record.scene_id
        labels, instances, parts = (
            cv2.imread(str(folder / f"{name}_gtFine_{what}.png"), cv2.IMREAD_UNCHANGED).astype(int)
            for what in ("labelIds", "instanceIds", "partIds")
        )
        ids = truth.pictures[place].ids
        for thing in truth.record.objects:
            at = ids == truth.ids[thing.name]
            assert (labels[at] == names["labels"][thing.category]).all()
            assert len(np.unique(instances[at])) <= 1 and (instances[at] // 1000 == labels[at]).all()
        no_object = ~np.isin(ids, [truth.ids[thing.name] for thing in truth.record.objects])
        assert (instances[no_object] == labels[no_object]).all()
        assert {n for n, at in names["parts"].items() if (parts == at).any()} <= {"can/base", "can/lid"}
        assert (written / "cityscapes" / "leftImg8bit" / "train" / truth.record.scene_id).is_dir()


def test_bop_models_reprojected_agree_with_depths_and_masks(written: Path) -> None:
    root = written / "bop"
    models = {
        int(path.stem.removeprefix("obj_")): trimesh.load(path, process=False)
        for path in sorted((root / "models").glob("*.ply"))
    }
    seen = 0
    for folder in sorted((root / "train_pbr").iterdir()):
        cameras, poses, infos = (
            json.loads((folder / f"scene_{what}.json").read_text()) for what in ("camera", "gt", "gt_info")
        )
        for image, camera in cameras.items():
            depth_mm = cv2.imread(str(folder / "depth" / f"{int(image):06d}.png"), cv2.IMREAD_UNCHANGED)
            for number, (pose, info) in enumerate(zip(poses[image], infos[image], strict=True)):
                masks = [
                    cv2.imread(str(folder / what / f"{int(image):06d}_{number:06d}.png"), cv2.IMREAD_UNCHANGED) > 0
                    for what in ("mask", "mask_visib")
                ]
                assert info["px_count_visib"] == masks[1].sum() and info["px_count_all"] >= masks[0].sum()
                drawn_mm = drawn(models[pose["obj_id"]], pose, camera, depth_mm.shape)
                if info["px_count_all"] < 100 or not masks[0].any():
                    continue
                silhouette = drawn_mm > 0
                assert (silhouette & masks[0]).sum() / (silhouette | masks[0]).sum() >= 0.98
                at = masks[1] & silhouette
                if at.sum() > 20:
                    off_mm = np.abs(drawn_mm - depth_mm * camera["depth_scale"])[at]
                    assert np.median(off_mm) <= 2
                    seen += 1
    assert seen >= 9


def drawn(
    model: trimesh.Trimesh, pose: dict[str, list[float]], camera: dict[str, list[float]], shape: tuple[int, ...]
) -> np.ndarray:
    """Depths (mm) of a BOP model by rays, with OpenCV's axes and (0, 0) the centre of the upper left pixel; 0: nothing."""
    k = np.array(camera["cam_K"]).reshape(3, 3)
    rows, columns = np.indices(shape)
    directions = np.stack([columns, rows, np.ones(shape)], -1).reshape(-1, 3) @ np.linalg.inv(k).T
    rotation = np.array(pose["cam_R_m2c"]).reshape(3, 3)
    posed = trimesh.Trimesh(model.vertices @ rotation.T + pose["cam_t_m2c"], model.faces, process=False)
    posed.apply_scale(0.001)
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    distance_m, face = RayCaster(posed).first_hits(np.zeros_like(directions), directions / length)
    return np.where(face >= 0, 1000 * distance_m / length[:, 0], 0.0).reshape(shape)


def test_bop_symmetries_keep_the_models_as_they_are(written: Path) -> None:
    models = json.loads((written / "bop" / "models" / "models_info.json").read_text())
    objects = json.loads((written / "bop" / "objects.json").read_text())
    by_category = {objects[number]["category"]: (number, info) for number, info in models.items()}
    for category in ("can", "mixing bowl"):
        (symmetry,) = by_category[category][1]["symmetries_continuous"]
        assert np.abs(np.abs(symmetry["axis"]) - [0, 0, 1]).max() < 1e-6
        assert np.hypot(*symmetry["offset"][:2]) < 1.5, "mm"
    number, box = by_category["box"]
    mesh = trimesh.load(written / "bop" / "models" / f"obj_{int(number):06d}.ply", process=False)
    assert len(box["symmetries_discrete"]) == 3, "a box has three half turns"
    for row in box["symmetries_discrete"]:
        motion = np.array(row).reshape(4, 4)
        assert np.linalg.det(motion[:3, :3]) == pytest.approx(1)
        assert (
            np.abs(np.sort(transform_points(motion, mesh.vertices), axis=0) - np.sort(mesh.vertices, axis=0)).max()
            < 1.5
        )
    assert box["diameter"] == pytest.approx(1000 * np.linalg.norm([0.12, 0.08, 0.06]), rel=0.01)
    assert [box[f"size_{axis}"] for axis in "xyz"] == pytest.approx([120, 80, 60], rel=0.01)


@pytest.mark.parametrize(
    ("mesh", "discrete", "continuous"),
    [
        (trimesh.creation.box((0.06, 0.06, 0.06)), 23, 0),
        pytest.param(trimesh.creation.cylinder(0.025, 0.14, sections=6), 11, 0, marks=pytest.mark.slow),
        (trimesh.creation.icosphere(subdivisions=3, radius=0.035), 23, 3),
    ],
    ids=["cube", "hexagonal prism", "ball"],
)
def test_bop_lists_each_turn_of_regular_shapes(mesh: trimesh.Trimesh, discrete: int, continuous: int) -> None:
    grey = np.full((len(mesh.vertices), 3), 128, np.uint8)
    info = BopModel("regular", mesh, grey).info()
    for suffix in ("", "_with_color"):
        assert len(info[f"symmetries_discrete{suffix}"]) == discrete
        axes = [each["axis"] for each in info.get(f"symmetries_continuous{suffix}", [])]
        assert np.allclose(np.abs(np.array(axes).reshape(-1, 3)).sum(0), continuous / 3), "one each way"


def test_colors_of_bop_models_are_srgb_as_their_pictures_are(tmp_path: Path) -> None:
    write_thing(tmp_path, 0, slab("box", 0.1, 0.1, 0.1))
    model = BopModel.of_twin(tmp_path / twin_name(twin_id(0)))
    assert (model.colors == [229, 79, 79]).all(), "the factor (200, 20, 20) / 255 is linear (glTF 2.0, 3.9.2)"


def test_clouds_are_the_pictures_at_their_pixels(written: Path, truths: list[SceneTruth]) -> None:
    classes = json.loads((written / "pointcloud" / "classes.json").read_text())
    for truth in truths:
        with np.load(written / "pointcloud" / "train" / f"{truth.record.scene_id}.npz") as cloud:
            arrays = dict(cloud)
        assert arrays["cameras"].tolist() == [picture.name for picture in truth.pictures]
        for number, picture in enumerate(truth.pictures):
            own = arrays["camera"] == number
            column, row = arrays["pixel"][own].T
            seen = transform_points(inverse(picture.camera.camera_to_object), arrays["xyz_m"][own].astype(float))
            pixels = (picture.intrinsics @ (seen * [1, -1, -1]).T).T
            assert np.abs(pixels[:, :2] / pixels[:, 2:] - np.stack([column, row], -1) - 0.5).max() < 0.01
            assert np.abs(-seen[:, 2] - picture.depth_m[row, column]).max() < 1e-5
            assert (arrays["rgb"][own] == picture.rgb[row, column]).all()
            assert (arrays["instance"][own] == picture.ids[row, column]).all()
            assert (arrays["part"][own] > 0).sum() == (picture.parts[row, column] > 0).sum()
            lid = arrays["part"][own] == classes["part"]["can/lid"]
            assert (arrays["semantic"][own][lid] == classes["semantic"]["can"]).all()
            assert np.abs(np.linalg.norm(arrays["normal"][own][arrays["instance"][own] > 0], axis=1) - 1).max() < 0.01


def test_a_cloud_has_no_more_points_than_are_asked_for(scenes: Path, tmp_path: Path) -> None:
    write_segmentation(scenes, tmp_path / "few", "pointcloud", points=500)
    write_segmentation(scenes, tmp_path / "again", "pointcloud", points=500)
    (one, *_), (other, *_) = (sorted((tmp_path / name).rglob("*.npz")) for name in ("few", "again"))
    assert len(np.load(one)["xyz_m"]) == 500 and one.read_bytes() == other.read_bytes()


def test_a_scene_is_whole_in_one_split(scenes: Path, tmp_path: Path) -> None:
    write_segmentation(scenes, tmp_path / "half", "coco", validation_share=0.5)
    said = {
        path.stem.removeprefix("instances_"): {image["scene_id"] for image in json.loads(path.read_text())["images"]}
        for path in (tmp_path / "half" / "annotations").glob("instances_*.json")
    }
    assert set().union(*said.values()) == {"layout_0_000000", "layout_0_000001"}
    assert sum(map(len, said.values())) == 2


def test_bop_has_a_scene_in_the_split_of_the_other_formats(scenes: Path, tmp_path: Path) -> None:
    write_segmentation(scenes, tmp_path / "coco", "coco", validation_share=0.5)
    write_segmentation(scenes, tmp_path / "bop", "bop", validation_share=0.5)
    for split in ("train", "val"):
        images = json.loads((tmp_path / "coco" / "annotations" / f"instances_{split}.json").read_text())["images"]
        there = sorted(path.name for path in (tmp_path / "bop" / f"{split}_pbr").glob("*"))
        assert there == sorted({f"{int(image['scene_id'].removeprefix('layout_0_')):06d}" for image in images})
        assert there, "one scene of the two is in each"


def test_what_fails_leaves_nothing(scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> np.ndarray:
        raise UsageError("front_ids.png: is not a readable PNG")

    monkeypatch.setattr(Classes, "class_picture", broken)
    with pytest.raises(UsageError):
        write_segmentation(scenes, tmp_path / "out", "cityscapes")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("form", "out", "share", "cause"),
    [
        ("pascal", "new", 0.1, "coco-panoptic"),
        ("coco", "there", 0.1, "not empty"),
        ("coco", "new", 1.5, "give 0 to 1"),
        ("coco", "new", float("nan"), "give 0 to 1"),
    ],
)
def test_wrong_use_is_said_in_one_line(
    scenes: Path, tmp_path: Path, form: str, out: str, share: float, cause: str
) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "mine").write_text("x")
    with pytest.raises(UsageError, match=cause) as error:
        write_segmentation(scenes, tmp_path / out, form, validation_share=share)
    assert "\n" not in str(error.value) and not (tmp_path / "new").exists()
