"""Every file of the shared bad inputs behaves as its manifest asks, one by one, through the whole command."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image, ImageOps

import manitwin
import manitwin.config
from manitwin.formats.image_file import read_image
from manitwin.pipeline.build_report import ItemResult
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.record import TwinRecord

pytestmark = pytest.mark.shared_data

REJECTED = {
    "truncated.jpg": ("input", {"unreadable"}, "truncated"),
    "zero_byte.png": ("input", {"empty"}, "zero bytes"),
    "text_renamed.png": ("input", {"wrong_type"}, "image"),
    "animated.gif": ("input", {"animated"}, "animated"),
    "animated.webp": ("input", {"animated"}, "animated"),
    "several_objects.jpg": ("generate", {"several_objects"}, "objects"),
    "blank_white.png": ("generate", {"no_object"}, "object"),
    "one_pixel.png": ("input", {"too_small"}, "1"),
    "nan_vertices.obj": ("input", {"not_finite"}, "50"),
    "zero_faces.obj": ("input", {"no_faces"}, "face"),
    "scene_four_objects.glb": ("gate", {"several_objects"}, "4"),
}
FEW_GRASPS = manitwin.config.BuildConfig(grasps={"simulated": 10, "unfiltered": 2, "least_per_point": 0})
NAMES = {
    "cmyk.jpg": "fork",
    "gray16.png": "flashlight",
    "exif_rotated.jpg": "hammer",
    "rgba_garbage_under_alpha.png": "orange",
    "nonmanifold.obj": "toy",
    "millimetres.obj": "spatula",
    "missing_texture.obj": "box",
}


SLOW_TO_BUILD = ("cmyk.jpg", "gray16.png", "exif_rotated.jpg", "nonmanifold.obj")
"""Those that are built beside the originals that they are compared with, by the slow tests."""


@pytest.fixture(scope="module")
def results(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, ItemResult]:
    """Build all but the slow ones in one command."""
    with (shared_data / "bad" / "manifest.csv").open() as stream:
        files = [row["file"] for row in csv.DictReader(stream)]
    assert set(files) == set(REJECTED) | set(NAMES)
    rows = [(shared_data / "bad" / file, NAMES.get(file, "")) for file in files if file not in SLOW_TO_BUILD]
    return build_rows(rows, tmp_path_factory.mktemp("bad"))


@pytest.fixture(scope="module")
def compared(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, ItemResult]:
    """Build the slow ones and the upright originals that they are compared with in one command."""
    folder = tmp_path_factory.mktemp("compared")
    rows = [(shared_data / "bad" / file, NAMES[file]) for file in SLOW_TO_BUILD]
    rows += [
        (shared_data / "photos" / "claw_hammer.jpg", "hammer"),
        (shared_data / "photos" / "steel_fork.jpg", "fork"),
    ]
    with Image.open(shared_data / "bad" / "exif_rotated.jpg") as turned:
        ImageOps.exif_transpose(turned).save(folder / "upright.png")
    rows += [(folder / "upright.png", "hammer")]
    rows += [(shared_data / "meshes" / "toy_dinosaur" / "dinosaur_figure.obj", "toy")]
    return build_rows(rows, folder)


def build_rows(rows: list[tuple[Path, str]], folder: Path) -> dict[str, ItemResult]:
    """Build files with their names; return the results by file name."""
    manifest = folder / "manifest.csv"
    manifest.write_text("file,name\n" + "".join(f"{file},{name}\n" for file, name in rows))
    # one worker: several would each load what it loads, and tests run side by side as it is
    report = manitwin.build(manifest, folder / "out", config=FEW_GRASPS, quick=True, jobs=1)
    assert report.count("unfinished") == 0, [r.detail for r in report.results if r.status == "unfinished"]
    left = {p.name for p in (folder / "out").glob("twins/*/*")}
    assert left == {r.twin_id for r in report.results}, "every input ends in a folder, and nothing else is there"
    return {Path(r.item.file or "").name: r for r in report.results}


def record(result: ItemResult) -> TwinRecord:
    assert result.folder is not None
    return manitwin.load(result.folder, verify=True).record


@pytest.mark.parametrize("file", sorted(REJECTED))
def test_unusable_input_is_rejected_with_its_reason(results: dict[str, ItemResult], file: str) -> None:
    stage, reasons, word = REJECTED[file]
    found = record(results[file])
    assert found.rejection is not None
    assert (found.rejection.stage, found.rejection.reason in reasons) == (stage, True), found.rejection
    assert word in found.rejection.detail
    assert file in found.rejection.detail or stage != "input"
    assert "\n" not in found.rejection.detail


def test_millimetres_are_told_from_metres(results: dict[str, ItemResult]) -> None:
    found = record(results["millimetres.obj"])
    assert found.physical is not None
    assert max(found.physical.extents_m) == pytest.approx(0.24, abs=0.002)
    assert any("mm" in check.message or "millimet" in check.message for check in found.quality.checks)


def test_missing_texture_is_a_finding(results: dict[str, ItemResult]) -> None:
    found = record(results["missing_texture.obj"])
    assert found.physical is not None
    assert sorted(found.physical.extents_m) == pytest.approx([0.02, 0.06, 0.09], abs=1e-4)
    assert any("mtl" in check.message for check in found.quality.checks if check.passed is False)


@pytest.mark.slow
def test_damaged_dinosaur_has_the_volume_of_the_clean_one(compared: dict[str, ItemResult]) -> None:
    damaged, clean = record(compared["nonmanifold.obj"]), record(compared["dinosaur_figure.obj"])
    assert damaged.mesh is not None and clean.mesh is not None
    assert damaged.mesh.volume_m3 == pytest.approx(clean.mesh.volume_m3, rel=0.02)
    assert any("holes" in repair for repair in damaged.mesh.repairs)
    assert not any("holes" in repair for repair in clean.mesh.repairs)


@pytest.mark.slow
def test_exif_rotation_gives_the_twin_of_the_upright_photo(compared: dict[str, ItemResult]) -> None:
    turned, upright, original = (record(compared[f]) for f in ("exif_rotated.jpg", "upright.png", "claw_hammer.jpg"))
    assert turned.physical is not None and upright.physical is not None and original.physical is not None
    # the same pixels stored upright: the same twin
    assert turned.physical.extents_m == pytest.approx(upright.physical.extents_m, abs=1e-4)
    assert turned.language is not None and upright.language is not None
    assert turned.language.color == upright.language.color
    # the original photo has twice the resolution: the same size as far as the independent check of twins tells sizes apart
    same_size_m = 0.01 * max(original.physical.extents_m)
    assert turned.physical.extents_m == pytest.approx(original.physical.extents_m, abs=same_size_m)


def mean_lab(photo: Path) -> np.ndarray:
    """The mean CIE Lab colour of a photo as it is read."""
    pixels = np.ascontiguousarray(read_image(photo).pixels[..., :3], np.float32) / 255
    return cv2.cvtColor(pixels, cv2.COLOR_RGB2LAB).reshape(-1, 3).mean(0)


@pytest.mark.slow
def test_cmyk_photo_keeps_its_colours(compared: dict[str, ItemResult], shared_data: Path) -> None:
    assert compared["cmyk.jpg"].status == compared["steel_fork.jpg"].status
    # 10 is what two people would call the same colour in two photos; inverted CMYK is 50 and more away
    converted, original = shared_data / "bad" / "cmyk.jpg", shared_data / "photos" / "steel_fork.jpg"
    assert np.linalg.norm(mean_lab(converted) - mean_lab(original)) < 10


def test_colour_under_transparent_pixels_never_shows(results: dict[str, ItemResult]) -> None:
    found = record(results["rgba_garbage_under_alpha.png"])
    assert found.language is not None and found.status == "accepted"
    assert not {"magenta", "pink", "purple"} & set(found.language.color.split())
    assert "orange" in found.language.color
    folder = results["rgba_garbage_under_alpha.png"].folder
    assert folder is not None
    for view in sorted((folder / "views").glob("rgb_*.webp")):
        red, green, blue = np.moveaxis(np.asarray(Image.open(view).convert("RGB"), int), -1, 0)
        assert not ((red > 180) & (green < 60) & (blue > 180)).any()


@pytest.mark.slow
def test_sixteen_bit_photo_is_scaled_not_clipped(compared: dict[str, ItemResult]) -> None:
    result = compared["gray16.png"]
    found = record(result)
    if found.status == "rejected":
        assert found.rejection is not None and found.rejection.stage == "generate"
        return
    assert found.language is not None and found.language.color != "white"


def test_source_is_kept_byte_for_byte(results: dict[str, ItemResult], shared_data: Path) -> None:
    folder = results["zero_byte.png"].folder
    assert folder is not None
    assert (folder / "source.png").read_bytes() == b""
    original = shared_data / "bad" / "text_renamed.png"
    rejected = results["text_renamed.png"].folder
    assert rejected is not None and (rejected / "source.png").read_bytes() == original.read_bytes()


def test_a_rejected_input_is_not_tried_again(results: dict[str, ItemResult], shared_data: Path, tmp_path: Path) -> None:
    folder = results["one_pixel.png"].folder
    assert folder is not None
    place = tmp_path / twin_name(folder.name)
    shutil.copytree(folder, place)
    report = manitwin.build(shared_data / "bad" / "one_pixel.png", tmp_path, config=FEW_GRASPS, quick=True)
    assert [r.reused for r in report.results] == [True]
    assert json.loads((place / "twin.json").read_text())["status"] == "rejected"
