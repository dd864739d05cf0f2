"""A cut-out that is doubted is kept with the rejection, and built where a person says that it is right."""

from __future__ import annotations

import hashlib
import io
import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

import manitwin
from manitwin.cli.main import app
from manitwin.config import BuildConfig, MattingConfig
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.models.matting.matte import DoubtfulMatte, Matte
from manitwin.pipeline.cutout import CUTOUT, SHOWN_PX, confirmation, confirmed_or_rejected, encode_preview
from manitwin.pipeline.item import Item
from manitwin.pipeline.photo import PhotoStage
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import read_record

SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "bottle.jpg"
DOUBTING = MattingConfig(min_confidence=0.985)


def half() -> np.ndarray:
    """Return a photo of noise, the left half of which is the thing."""
    rgba = np.random.default_rng(0).integers(0, 256, (1500, 3000, 4), np.uint8)
    rgba[..., 3] = 0
    rgba[:, :1500, 3] = 255
    return rgba


def test_picture_of_a_cut_out_is_small_and_keeps_what_would_be_cut_away() -> None:
    picture = encode_preview(half())
    shown = np.asarray(Image.open(io.BytesIO(picture)))
    assert shown.shape == (SHOWN_PX // 2, SHOWN_PX, 4) and picture == encode_preview(half())
    assert (shown[:, : SHOWN_PX // 2, 3] == 255).all() and (shown[:, SHOWN_PX // 2 :, 3] == 0).all()
    assert shown[:, SHOWN_PX // 2 :, :3].mean() == pytest.approx(127.5, abs=3)


def test_only_the_picture_that_was_looked_at_is_confirmed() -> None:
    doubted = DoubtfulMatte("low_confidence_matte", "a.jpg: why", Matte(half(), "network", 0.4, ("cut",), {}))
    doubted = pickle.loads(pickle.dumps(doubted))
    sha256 = hashlib.sha256(encode_preview(half())).hexdigest()
    matte = confirmed_or_rejected(doubted, "a.jpg", {"cutout": {"sha256": sha256, "source": "human:ada"}})
    assert matte.confidence == 0.4
    assert matte.findings == ("doubtful by itself (0.40); human:ada confirmed the cut-out", "cut")
    with pytest.raises(
        Rejected, match=r"a\.jpg: the cut-out differs from the one that human:ada confirmed; check"
    ) as caught:
        confirmed_or_rejected(doubted, "a.jpg", {"cutout": {"sha256": "0" * 64, "source": "human:ada"}})
    assert (caught.value.reason, set(caught.value.files)) == ("low_confidence_matte", {CUTOUT})
    with pytest.raises(Rejected, match=r"^low_confidence_matte: a\.jpg: why$") as caught:
        confirmed_or_rejected(doubted, "a.jpg", {})
    assert pickle.loads(pickle.dumps(caught.value)).files == {CUTOUT: encode_preview(half())}


def test_what_would_be_cut_out_otherwise_now_is_cut_out_as_it_was_confirmed() -> None:
    said = {"cutout": confirmation(encode_preview(half()), "human:ada")}
    assert said["cutout"]["sha256"] == hashlib.sha256(encode_preview(half())).hexdigest()
    otherwise = half()
    otherwise[..., 3] = np.roll(otherwise[..., 3], 300, axis=1)
    doubted = DoubtfulMatte("low_confidence_matte", "a.jpg: why", Matte(otherwise, "network", 0.4, ("cut",), {}))
    matte = confirmed_or_rejected(doubted, "a.jpg", said)
    assert matte.findings == ("cut out as human:ada confirmed it",) and matte.confidence == 0.4
    assert (matte.rgba[..., :3] == otherwise[..., :3]).all() and matte.rgba.flags.c_contiguous
    differs = matte.rgba[..., 3] != half()[..., 3]
    assert not differs[:, :1496].any() and not differs[:, 1504:].any(), "but for the pixels of the border"


@pytest.mark.parametrize("damage", ["nonsense", "", "bm8gcGljdHVyZQ=="])
def test_what_was_confirmed_of_another_part_of_the_photo_or_cannot_be_read_is_looked_at_again(damage: str) -> None:
    said = confirmation(encode_preview(half()), "human:ada")
    part = DoubtfulMatte("low_confidence_matte", "a.jpg: why", Matte(half()[:900], "network", 0.4, (), {}))
    whole = half()
    whole[:700, :, 3] = 255
    otherwise = DoubtfulMatte("low_confidence_matte", "a.jpg: why", Matte(whole, "network", 0.4, (), {}))
    for doubted, kept in ((part, said), (otherwise, {**said, "alpha_png": damage})):
        with pytest.raises(Rejected, match="differs from the one that human:ada confirmed; check it again"):
            confirmed_or_rejected(doubted, "a.jpg", {"cutout": kept})


def test_what_shows_nothing_has_no_cut_out(tmp_path: Path) -> None:
    Image.new("RGB", (400, 300), (200, 200, 200)).save(tmp_path / "bare.png")
    with pytest.raises(Rejected) as caught:
        PhotoStage(MattingConfig()).run(Draft("t", Item(str(tmp_path / "bare.png")), seed=0), tmp_path)
    assert (caught.value.reason, caught.value.files) == ("no_object", {})


@pytest.mark.slow
def test_confirmed_cut_out_becomes_a_twin_and_stays_one(tmp_path: Path) -> None:
    place, runner, photo = tmp_path / "twins", CliRunner(), tmp_path / "thing.jpg"
    shutil.copy(SAMPLE, photo)
    config = BuildConfig(
        matting=DOUBTING.model_dump(), grasps={"simulated": 8, "unfiltered": 0, "least_per_point": 2, "tries_per_point": 4},
        second_opinion={"enabled": False}, robustness={"enabled": False},
    )  # fmt: skip
    [result] = manitwin.build(photo, place, config=config, executor="inline").results
    assert result.status == "rejected" and result.folder is not None
    record = read_record(result.folder)
    assert set(record.files) == {CUTOUT, "source.jpg"}
    assert DatasetRoot(place).exists(f"twins/{record.twin_id[:2]}/{record.twin_id}/{CUTOUT}")

    sheet = tmp_path / "sheet.png"
    done = runner.invoke(app, ["review", "cutouts", str(place), "--sheet", str(sheet)])
    assert done.exit_code == 0 and record.twin_id in done.output and "1 cut-outs are doubted" in done.output
    page = np.asarray(Image.open(sheet).convert("RGB")).astype(int)
    magenta = (page[..., 0] - page[..., 1] > 60) & (page[..., 2] - page[..., 1] > 60)
    tile = page[4:260, 4:260]
    assert 0.5 < magenta[4:260, 36:228].mean() < 0.95 and tile[120:140, 118:138].std() < 60

    wrong = runner.invoke(app, ["review", "cutouts", str(place), "--accept", "zz"])
    assert wrong.exit_code != 0 and "no rejected photo with a cut-out" in str(wrong.exception)
    said = ["review", "cutouts", str(place), "--accept", record.twin_id[:4], "--annotator", "ada", "--jobs", "1"]
    done = runner.invoke(app, said)
    assert done.exit_code == 0 and "1 cut-outs are confirmed by ada: 1 accepted" in done.output, done.output
    after = read_record(result.folder)
    assert (after.status, after.twin_id) == ("accepted", record.twin_id) and CUTOUT not in after.files
    [matte] = [check for check in after.quality.checks if check.name == "matte"]
    assert matte.passed is False and "human:ada confirmed the cut-out" in matte.message
    assert matte.value is not None and matte.value < DOUBTING.min_confidence
    [again] = manitwin.build(photo, place, executor="inline").results
    assert again.reused, "what was confirmed holds for later builds"
    assert "0 cut-outs are doubted" in runner.invoke(app, ["review", "cutouts", str(place)]).output
    assert manitwin.Dataset(place).table(["twin_id"])["twin_id"].to_pylist() == [record.twin_id]
