"""A catalogue of a small data set, read as the published loaders of each layout read it."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from pycocotools.coco import COCO

from manitwin.dataset.catalog.groups import assign_groups, split_of
from manitwin.dataset.catalog.surface import surface_points
from manitwin.dataset.catalog.write import write_catalog
from manitwin.dataset.index.near_duplicates import NearDuplicates, NearPair
from manitwin.dataset.index.rebuild import rebuild
from manitwin.errors import TwinError, UsageError
from manitwin.formats.glb import write_glb
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.loaded_twin import Twin
from scene_twins import can, slab, write_thing
from twin_folders import twin_id

SPLITS = ("train", "val", "test")


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("set")
    for number, thing in enumerate((can(), slab("tea box", 0.05, 0.04, 0.08, 0.2), can())):
        write_thing(root, number, thing)
    rebuild(DatasetRoot(root), jobs=1)
    return root


@pytest.fixture(scope="module")
def written(dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("out") / "catalog"
    done = write_catalog(dataset, out, size_px=32)
    assert (sum(done.twins.values()), done.pictures, done.categories, done.joined_groups) == (3, 90, 2, 1)
    return out


def rows(written: Path) -> list[dict[str, object]]:
    listed: list[dict[str, object]] = json.loads((written / "catalog.json").read_text())["twins"]
    return listed


def test_near_duplicates_are_in_one_split(written: Path) -> None:
    by_id = {row["twin_id"]: row for row in rows(written)}
    first, other, copy = (by_id[twin_id(number)] for number in range(3))
    assert first["group"] == copy["group"] != other["group"] and first["split"] == copy["split"]


def test_groups_join_what_any_link_joins() -> None:
    near = NearDuplicates({"s": ["b", "d"]}, [NearPair("a", "b", 0.0, 1.0), NearPair("c", "e", 0.0, 1.0)])
    assert assign_groups(list("abcdef"), near) == {"a": "a", "b": "a", "c": "c", "d": "a", "e": "c", "f": "f"}
    splits = [split_of(str(number)) for number in range(4000)]
    for split, share in zip(SPLITS, (0.8, 0.1, 0.1), strict=True):
        assert splits.count(split) / 4000 == pytest.approx(share, abs=0.02)


def test_openshapes_loader_finds_what_it_reads(dataset: Path, written: Path) -> None:
    """As ``get_objaverse`` and ``ObjaverseLVIS`` of OpenShape's src/data.py read it, but for CLIP's features."""
    seen = 0
    for split in SPLITS:
        for meta in json.loads((written / "openshape" / f"{split}.json").read_text()):
            assert set(meta) == {"id", "dataset", "group", "data_path", "category"} and meta["group"] == split
            data = np.load(written / meta["data_path"], allow_pickle=True).item()
            assert data["xyz"].shape == data["rgb"].shape == (10_000, 3)
            assert data["rgb"].min() >= 0 and data["rgb"].max() <= 1
            assert isinstance(data["text"][0], str) and data["retrieval_text"][0].startswith("A ")
            twin = Twin(dataset / twin_name(meta["id"]))
            assert np.ptp(data["xyz"][:, 1]) == pytest.approx(np.ptp(twin.visual[0].vertices[:, 2]), rel=0.02), (
                "+Y is up"
            )
            seen += 1
    assert seen == 3


def test_ulips_loader_finds_what_it_reads(written: Path) -> None:
    """As ``ShapeNet`` of ULIP's data/dataset_3d.py reads it: names cut at the first hyphen and dot, 30 pictures, two kinds."""
    names = {each["synsetId"]: each["name"] for each in json.loads((written / "ulip" / "taxonomy.json").read_text())}
    assert "can" in names["can"].split(",")
    seen = 0
    for split in SPLITS:
        for line in (written / "ulip" / f"{split}.txt").read_text().split():
            taxonomy = line.split("-")[0]
            model = line[len(taxonomy) + 1 :].split(".")[0]
            assert taxonomy in names
            cloud = np.load(written / "ulip" / "pointclouds" / line)
            assert cloud.shape == (8192, 3) and cloud.dtype == np.float32
            for degrees in range(0, 360, 12):
                for kind in ("", "_depth0001"):
                    file = (
                        written / "pictures" / f"{taxonomy}-{model}" / f"{taxonomy}-{model}_r_{degrees:03d}{kind}.png"
                    )
                    picture = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
                    assert picture.shape[:2] == (32, 32) and picture.std() > 3
            seen += 1
    assert seen == 3


def test_captions_are_cocos_and_classes_are_a_list_of_files(written: Path, capsys: pytest.CaptureFixture[str]) -> None:
    classes = (written / "classification" / "classes.txt").read_text().splitlines()
    pictures = 0
    for split in SPLITS:
        coco = COCO(str(written / "captions" / f"{split}.json"))
        lines = (written / "classification" / f"{split}.txt").read_text().splitlines()
        labels = dict(line.rsplit(" ", 1) for line in lines)
        assert {image["file_name"] for image in coco.loadImgs(coco.getImgIds())} == set(labels)
        for image in coco.loadImgs(coco.getImgIds()):
            (row,) = (each for each in rows(written) if each["twin_id"] == image["twin_id"])
            said = [each["caption"] for each in coco.loadAnns(coco.getAnnIds(imgIds=image["id"]))]
            assert said == row["captions"] and classes[int(labels[image["file_name"]])] == row["category"]
            assert (written / image["file_name"]).is_file()
        pictures += len(labels)
    assert pictures == 90


def test_points_lie_on_the_surface_with_its_normals_and_colors(dataset: Path) -> None:
    twin = Twin(dataset / twin_name(twin_id(1)))
    points = surface_points(twin, 500, 3)
    (mesh,) = twin.visual
    _, distance, face = trimesh.proximity.closest_point_naive(mesh, points.points_m)
    assert distance.max() < 1e-6 and np.einsum("ij,ij->i", mesh.face_normals[face], points.normals).min() > 0.99
    assert (points.rgb == [229, 79, 79]).all(), (
        "sRGB of the factor (200, 20, 20) / 255, which is linear (glTF 2.0, 3.9.2)"
    )
    again = surface_points(twin, 500, 3)
    assert (again.points_m == points.points_m).all()


def test_a_texture_colors_the_points_where_it_lies(tmp_path: Path) -> None:
    from PIL import Image

    write_thing(tmp_path, 0, slab("box", 0.1, 0.1, 0.1))
    folder = tmp_path / twin_name(twin_id(0))
    plate = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], process=False)
    half = np.zeros((64, 64, 3), np.uint8)
    half[:, 32:] = (255, 255, 0)
    material = trimesh.visual.material.PBRMaterial(
        baseColorTexture=Image.fromarray(half),
        baseColorFactor=[255, 255, 255, 255],
        metallicFactor=0.0,
        roughnessFactor=0.5,
    )
    plate.visual = trimesh.visual.TextureVisuals(uv=plate.vertices[:, :2], material=material)
    plate.metadata["name"] = "plate"
    (folder / "visual.glb").write_bytes(write_glb([plate]))
    points = surface_points(Twin(folder), 400, 0)
    yellow = points.rgb[:, 0] > 128
    assert 0.4 < yellow.mean() < 0.6
    assert (yellow == (points.points_m[:, 0] > 0.5)).mean() > 0.95


def test_the_page_shows_the_twins_and_asks_for_nothing(written: Path) -> None:
    page = (written / "report.html").read_text()
    assert page.count("<img") == 3 and "3 twins of 2 categories" in page
    assert "http" not in page and "<script" not in page


def test_a_catalogue_is_the_same_again_and_never_over_another(dataset: Path, written: Path, tmp_path: Path) -> None:
    write_catalog(dataset, tmp_path / "again", size_px=32)
    files = sorted(path.relative_to(written) for path in written.rglob("*") if path.is_file())
    assert [(written / file).read_bytes() for file in files] == [
        (tmp_path / "again" / file).read_bytes() for file in files
    ]
    with pytest.raises(UsageError, match="not empty"):
        write_catalog(dataset, written)
    with pytest.raises(UsageError, match="not a data set"):
        write_catalog(tmp_path, tmp_path / "out")


def test_a_twin_that_cannot_be_read_is_left_out_with_the_reason(tmp_path: Path) -> None:
    ids = [write_thing(tmp_path, number, thing) for number, thing in enumerate((can(), can()))]
    rebuild(DatasetRoot(tmp_path), jobs=1)
    (tmp_path / twin_name(ids[0]) / "visual.glb").unlink()
    done = write_catalog(tmp_path, tmp_path / "catalog", size_px=32)
    assert sum(done.twins.values()) == 1 and done.joined_groups == 0 and list(done.left_out) == [ids[0]]
    listed = json.loads((tmp_path / "catalog" / "catalog.json").read_text())
    assert [row["twin_id"] for row in listed["twins"]] == [ids[1]]
    assert (
        "visual.glb" in listed["left_out"][ids[0]]
        and "visual.glb" in (tmp_path / "catalog" / "report.html").read_text()
    )
    (tmp_path / twin_name(ids[1]) / "visual.glb").unlink()
    with pytest.raises(TwinError, match=r"no twin of .* can be read.*visual\.glb"):
        write_catalog(tmp_path, tmp_path / "none", size_px=32)
    assert not (tmp_path / "none").exists()
