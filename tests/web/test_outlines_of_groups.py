"""Outlines of several photos of one thing: which are shown, where they are kept, and what is built of them."""

from __future__ import annotations

import io
import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest
from access_requests import asked
from doubted_photos import DOUBTING, SAMPLE
from PIL import Image, ImageOps

import manitwin
from manitwin.dataset.review.cutouts import doubted_photos
from manitwin.dataset.review.outlines import OutlineSession
from manitwin.engine.amendments import read_amendments
from manitwin.pipeline.drawn_outline import DRAWN_OF_SEVERAL, drawn_outline
from manitwin.pipeline.photo import PhotoStage
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import read_record
from manitwin.web.outline_application import outline_application


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set with one thing of two photos, neither of which is cut out; nothing may write there."""
    tmp_path = tmp_path_factory.mktemp("group")
    photos = tmp_path / "photos"
    photos.mkdir()
    front = ImageOps.scale(Image.open(SAMPLE), 0.5)
    front.save(photos / "front.png")
    ImageOps.mirror(front).save(photos / "side.png")
    (tmp_path / "list.csv").write_text(
        "file,name,group,turn_deg\nphotos/front.png,bottle,a,0\nphotos/side.png,bottle,a,90\n"
    )
    [result] = manitwin.build(tmp_path / "list.csv", tmp_path / "twins", config=DOUBTING, executor="inline").results
    assert result.status == "rejected"
    return tmp_path / "twins"


@pytest.fixture
def root(built: Path, tmp_path: Path) -> DatasetRoot:
    return DatasetRoot(shutil.copytree(built, tmp_path / "twins"))


def record_of(root: DatasetRoot, twin_id: str) -> TwinRecord:
    return read_record(Path(str(root.local)) / root.twin_name(twin_id))


def messages_of(record: TwinRecord) -> dict[str, str]:
    return {check.name: check.message for check in record.quality.checks}


@pytest.mark.slow
def test_each_photo_is_shown_kept_by_its_place_and_built(root: DatasetRoot) -> None:
    session = OutlineSession(root, "ada")
    front, side = session.photos
    twin_id = session.photos[front].twin_id
    assert (front, side) == (f"{twin_id}-1", f"{twin_id}-2") and doubted_photos(root) == []
    app = outline_application(session)
    listed = b"".join(each.get("body", b"") for each in asked(app, "/")[1:]).decode()  # type: ignore[misc]
    assert "front.png, photo 1 of 2: bottle" in listed and "side.png, photo 2 of 2: bottle" in listed
    assert f'href="/outline/{side}"' in listed and asked(app, f"/outline/{twin_id}")[0]["status"] == 404
    mask = session.mask(front)
    session.store_outline(front, mask, "ketchup bottle")
    assert session.outlined_keys == (front,) and session.words(side).name == "ketchup bottle"
    said = read_amendments(root, twin_id)[PhotoStage.name]
    assert set(said[DRAWN_OF_SEVERAL]) == {"0"} and said[DRAWN_OF_SEVERAL]["0"]["source"] == "human:ada"
    assert drawn_outline(said, "side.png", 1) is None and session.mask(front) == mask

    session.store_outline(side, session.mask(side))
    assert set(read_amendments(root, twin_id)[PhotoStage.name][DRAWN_OF_SEVERAL]) == {"0", "1"}
    assert session.build(jobs=1, executor="inline").counts_of_given == {"accepted": 1}
    record = record_of(root, twin_id)
    told = messages_of(record)["matte"]
    assert "front.png: cut out as human:ada drew its outline" in told and "side.png: cut out as human:ada" in told
    assert record.name == "ketchup bottle" and OutlineSession(root, "ben").photos == {}
    folder = Path(str(root.local)) / root.twin_name(twin_id)
    with zipfile.ZipFile(folder / "source.zip") as kept:
        assert {"photo_00.png", "photo_01.png", "mask_00.png", "mask_01.png"} <= set(kept.namelist())
        whole = np.asarray(Image.open(io.BytesIO(kept.read("mask_00.png"))))
        photo = Image.open(io.BytesIO(kept.read("photo_00.png")))
    assert whole.shape == photo.size[::-1] and 0.02 < (whole > 127).mean() < 0.8


@pytest.mark.slow
def test_photo_that_was_left_out_alone_is_shown_again_on_request(root: DatasetRoot) -> None:
    session = OutlineSession(root, "ada")
    front, side = session.photos
    twin_id = session.photos[front].twin_id
    session.store_outline(front, session.mask(front))
    session.build(jobs=1, executor="inline")
    record = record_of(root, twin_id)
    assert record.status == "accepted" and "left out: side.png" in messages_of(record)["matte"]
    assert OutlineSession(root, "ben").photos == {}
    again = OutlineSession(root, "ben", [twin_id[:6]])
    assert list(again.photos) == [side]
    again.store_outline(side, again.mask(side))
    assert again.build(jobs=1, executor="inline").counts_of_given == {"accepted": 1}
    told = messages_of(record_of(root, twin_id))["matte"]
    assert "front.png: cut out as human:ada" in told and "side.png: cut out as human:ben" in told
    assert list(OutlineSession(root, "ben", [twin_id]).photos) == [front, side], "none is left out: all are shown"
