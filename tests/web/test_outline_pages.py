"""The pages on which outlines are drawn, without a browser: what they give, keep and refuse."""

from __future__ import annotations

import base64
import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from access_requests import asked, header
from PIL import Image
from starlette.applications import Starlette

import manitwin
from manitwin.dataset.review.cutouts import confirm
from manitwin.dataset.review.outlines import OutlineSession
from manitwin.engine.amendments import read_amendments, write_amendments
from manitwin.errors import UsageError
from manitwin.pipeline.cutout import CONFIRMED
from manitwin.pipeline.drawn_outline import DRAWN, drawn_outline
from manitwin.pipeline.photo import PhotoStage
from manitwin.pipeline.settings import stored_config
from manitwin.twin.store import read_record
from manitwin.web.outline_application import MOST_BODY_BYTES


def body(messages: list[dict[str, object]]) -> bytes:
    return b"".join(each.get("body", b"") for each in messages[1:])  # type: ignore[misc]


def png(mask: np.ndarray) -> bytes:
    encoded = io.BytesIO()
    Image.fromarray(np.where(mask, 255, 0).astype(np.uint8)).save(encoded, "PNG")
    return encoded.getvalue()


def kept_by(app: Starlette, key: str, mask: bytes | None, **typed: object) -> tuple[int, dict[str, str]]:
    """Send what a page sends; return the status and what is answered."""
    encoded = None if mask is None else base64.b64encode(mask).decode()
    sent = json.dumps({"png": encoded, "name": None, "longest_side_cm": None, **typed}).encode()
    answer = asked(app, f"/outline/{key}", method="POST", body=sent)
    return int(answer[0]["status"]), json.loads(body(answer))


def box_in(size_px: tuple[int, int], least: float, most: float) -> np.ndarray:
    width, height = size_px
    mask = np.zeros((height, width), bool)
    mask[int(least * height) : int(most * height), int(least * width) : int(most * width)] = True
    return mask


def test_list_and_page_name_the_photos_and_give_picture_and_mask(
    outlining: Starlette, outlines: OutlineSession
) -> None:
    messages = asked(outlining, "/")
    page = body(messages).decode()
    first, second, bare = outlines.photos
    assert page.count('<li class="card">') == 3 and "first.jpg" in page and "3 of 3 are not drawn" in page
    assert header(messages, "cache-control") == "no-store"
    page = body(asked(outlining, f"/outline/{first}")).decode()
    assert f'data-next="/outline/{second}"' in page and "the object cannot be told from the background" in page
    picture = Image.open(io.BytesIO(body(asked(outlining, f"/outline/{first}/photo.webp"))))
    mask = Image.open(io.BytesIO(body(asked(outlining, f"/outline/{first}/mask.png"))))
    assert picture.size == mask.size and picture.mode == "RGB" and 0.02 < np.asarray(mask).mean() / 255 < 0.8
    nothing = np.asarray(Image.open(io.BytesIO(body(asked(outlining, f"/outline/{bare}/mask.png")))))
    assert nothing.shape == (300, 400) and not nothing.any()
    assert asked(outlining, "/outline/zz")[0]["status"] == 404
    assert asked(outlining, "/static/outline.js")[0]["status"] == 200


def test_outline_is_fitted_kept_and_shown_again(outlining: Starlette, outlines: OutlineSession) -> None:
    first, second, bare = outlines.photos
    root = outlines.root
    amendments = {PhotoStage.name: {CONFIRMED: {"sha256": "0" * 64, "source": "human:ben"}}}
    write_amendments(root, first, amendments)
    size_px = Image.open(io.BytesIO(outlines.picture(first))).size
    drawn = png(box_in(size_px, 0.3, 0.7))
    fitted = asked(outlining, f"/outline/{first}/fit", method="POST", body=drawn)
    assert fitted[0]["status"] == 200 and Image.open(io.BytesIO(body(fitted))).size == size_px
    assert read_amendments(root, first) == amendments, "to fit keeps nothing"
    status, kept = kept_by(outlining, first, drawn)
    assert status == 200 and kept == {"next": f"/outline/{second}", "name": "bottle", "longest_side_cm": ""}
    assert outlines.outlined_keys == (first,) and outlines.restated_twins == ()
    said = read_amendments(root, first)[PhotoStage.name]
    assert set(said) == {DRAWN} and said[DRAWN]["source"] == "human:ada"
    found = drawn_outline(said, "first.jpg")
    assert found is not None and (found.mask == box_in(size_px, 0.3, 0.7)).all()
    assert body(asked(outlining, f"/outline/{first}/mask.png")) == drawn
    assert "drawn, to be built" in body(asked(outlining, "/")).decode()
    assert kept_by(outlining, second, drawn)[1]["next"] == f"/outline/{bare}"
    outlines.store_outline(bare, png(box_in((400, 300), 0.3, 0.7)))
    assert kept_by(outlining, second, drawn)[1]["next"] == "/"


@pytest.mark.parametrize(
    ("sent", "why"),
    [
        (b"", "no PNG file"),
        (b"no picture", "no PNG file"),
        (png(np.ones((8, 8), bool)), "does not fit this photo; reload the page"),
        (png(np.ones((8, 2000), bool)), "at most 1024 pixels a side"),
        (bytes(MOST_BODY_BYTES + 1), "no PNG file"),
    ],
)
def test_what_is_no_outline_is_refused_and_nothing_is_kept(
    outlining: Starlette, outlines: OutlineSession, sent: bytes, why: str
) -> None:
    first = next(iter(outlines.photos))
    answer = asked(outlining, f"/outline/{first}/fit", method="POST", body=sent)
    assert answer[0]["status"] == 400 and why in json.loads(body(answer))["error"]
    status, told = kept_by(outlining, first, sent)
    assert status == 400 and ("its JSON is broken" if len(sent) > MOST_BODY_BYTES else why) in told["error"]
    assert outlines.outlined_keys == () and read_amendments(outlines.root, first) == {}


def test_empty_outlines_full_ones_and_those_of_two_things_are_not_kept(
    outlining: Starlette, outlines: OutlineSession
) -> None:
    first = next(iter(outlines.photos))
    size_px = Image.open(io.BytesIO(outlines.picture(first))).size
    two = box_in(size_px, 0.1, 0.4) | box_in(size_px, 0.6, 0.9)
    for mask, why in (
        (np.zeros(size_px[::-1], bool), "is empty"),
        (np.ones(size_px[::-1], bool), "covers the whole photo"),
        (two, "separate objects"),
    ):
        status, told = kept_by(outlining, first, png(mask), name="jar")
        assert status == 400 and told["error"].startswith("not kept: ") and why in told["error"]
    assert outlines.outlined_keys == outlines.restated_twins == () and read_amendments(outlines.root, first) == {}


def test_what_was_drawn_becomes_a_twin_that_says_so(outlines: OutlineSession, tmp_path: Path) -> None:
    first, second, bare = outlines.photos
    kept = outlines.mask(first)
    outlines.store_outline(first, kept)
    run = outlines.build(jobs=1, executor="inline")
    assert run.counts_of_given == {"accepted": 1}
    record = read_record(Path(str(outlines.root.local)) / outlines.root.twin_name(first))
    assert record.status == "accepted"
    [matte] = [check for check in record.quality.checks if check.name == "matte"]
    assert "cut out as human:ada drew its outline" in matte.message
    folder = Path(str(outlines.root.local)) / outlines.root.twin_name(first)
    assert record.source.mask == "source_mask.png" and set(record.files) >= {"source.jpg", "source_mask.png"}
    again = manitwin.build(
        folder / "source.jpg", tmp_path / "again", mask=folder / "source_mask.png", name="bottle",
        config=stored_config(outlines.root), executor="inline",
    ).results  # fmt: skip
    assert again[0].status == "accepted" and again[0].folder is not None
    assert read_record(again[0].folder).physical == record.physical, "its own files make it again"
    assert read_record(Path(str(outlines.root.local)) / outlines.root.twin_name(second)).status == "rejected"
    assert first not in OutlineSession(outlines.root, "ben").photos
    again = OutlineSession(outlines.root, "ben", [first[:6]])
    assert list(again.photos) == [first, second, bare] and again.mask(first) == kept
    with pytest.raises(UsageError, match=r"^zz: no photo; "):
        OutlineSession(outlines.root, "ben", ["zz"])


def test_cut_out_that_is_confirmed_takes_the_place_of_an_outline(outlines: OutlineSession) -> None:
    second = list(outlines.photos)[1]
    size_px = Image.open(io.BytesIO(outlines.picture(second))).size
    outlines.store_outline(second, png(box_in(size_px, 0.3, 0.7)))
    _, run = confirm(outlines.root, [second], "ben", jobs=1, executor="inline")
    assert run.counts_of_given == {"accepted": 1}
    assert set(read_amendments(outlines.root, second)[PhotoStage.name]) == {CONFIRMED}
    record = read_record(Path(str(outlines.root.local)) / outlines.root.twin_name(second))
    [matte] = [check for check in record.quality.checks if check.name == "matte"]
    assert "human:ben confirmed the cut-out" in matte.message and record.source.mask is None


def test_photo_that_is_gone_is_said_to_be(outlines: OutlineSession, tmp_path: Path) -> None:
    *_, bare = outlines.photos
    moved = replace(outlines.photos[bare], item=replace(outlines.photos[bare].item, file=str(tmp_path / "bare.png")))
    outlines.photos[bare] = moved
    with pytest.raises(UsageError, match=r"bare\.png: cannot be read"):
        outlines.picture(bare)
