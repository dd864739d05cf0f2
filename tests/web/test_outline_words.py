"""What a page of an outline says and keeps of a thing's name and size, without a browser."""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path

import pytest
from access_requests import asked
from doubted_photos import DOUBTING
from PIL import Image
from starlette.applications import Starlette

import manitwin
from manitwin.dataset.review.cutouts import photos_to_draw
from manitwin.dataset.review.outlines import OutlineSession
from manitwin.engine.amendments import read_amendments, write_amendments
from manitwin.errors import UsageError
from manitwin.pipeline.settings import stored_config
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import read_record


def answer_to(app: Starlette, address: str, sent: object, *, raw: bytes | None = None) -> tuple[int, dict[str, str]]:
    """Return the status and the answer to a JSON document, or to ``raw``."""
    messages = asked(app, address, method="POST", body=json.dumps(sent).encode() if raw is None else raw)
    return int(messages[0]["status"]), json.loads(b"".join(each.get("body", b"") for each in messages[1:]))


def said(app: Starlette, key: str, name: object = None, longest_side_cm: object = None) -> tuple[int, dict[str, str]]:
    return answer_to(app, f"/outline/{key}", {"png": None, "name": name, "longest_side_cm": longest_side_cm})


def page_of(app: Starlette, address: str) -> str:
    return b"".join(each.get("body", b"") for each in asked(app, address)[1:]).decode()


def record_of(root: DatasetRoot, twin_id: str) -> TwinRecord:
    return read_record(Path(str(root.local)) / root.twin_name(twin_id))


def checks_of(record: TwinRecord) -> dict[str, tuple[bool | None, str]]:
    return {check.name: (check.passed, check.message) for check in record.quality.checks}


def test_page_shows_what_was_given_and_suggests_known_names(outlining: Starlette, outlines: OutlineSession) -> None:
    first = next(iter(outlines.photos))
    page = page_of(outlining, f"/outline/{first}")
    assert 'id="name" data-focus="c" value="bottle"' in page and '<option value="mug">' in page
    assert 'id="longest_side_cm" data-focus="l" value=""' in page and "known as: bottle, " in page
    assert '<option value="unknown">' not in page


def test_name_and_size_are_kept_at_once_shown_again_and_taken_back(
    outlining: Starlette, outlines: OutlineSession
) -> None:
    first, second, _ = outlines.photos
    assert said(outlining, first, "", "")[1]["name"] == "bottle" and outlines.restated_twins == (), (
        "nothing is taken back of what was given"
    )
    status, kept = said(outlining, first, " ketchup bottle ", "12,5")
    assert status == 200 and kept["name"] == "ketchup bottle" and kept["longest_side_cm"] == "12.5"
    amendments = read_amendments(outlines.root, first)
    assert amendments["photo"] == amendments["generate"] == {"name": {"value": "ketchup bottle", "source": "human:ada"}}
    assert amendments["mesh"]["longest_side_m"] == {"value": 0.125, "low": 0.125, "high": 0.125, "source": "human:ada"}
    assert outlines.restated_twins == (first,) and outlines.outlined_keys == ()
    page = page_of(outlining, f"/outline/{first}")
    assert 'value="ketchup bottle"' in page and 'value="12.5"' in page
    listed = page_of(outlining, "/")
    assert "first.jpg: ketchup bottle" in listed and "named or measured, to be built" in listed
    assert OutlineSession(outlines.root, "ben").words(first).name == "ketchup bottle"
    assert said(outlining, first, None, "12.50") == (200, {**kept, "next": f"/outline/{second}"})
    assert read_amendments(outlines.root, first) == amendments, "what is not said anew stays as who said it"
    assert said(outlining, first, "bottle", "")[1]["name"] == "bottle"
    assert read_amendments(outlines.root, first) == {}


@pytest.mark.parametrize(
    ("name", "longest_side_cm", "why"),
    [
        ("mug\0", None, "the name: 'mug\\\\x00' contains control characters"),
        ("mug\nX", None, "contains control characters; use printable characters only"),
        ("\u202egum", None, "contains control characters"),
        ("m" * 201, None, "the name: 201 characters; give at most 200"),
        (7, None, "a name is a text"),
        ("mug", ["9"], "a longest side is a text"),
        *(
            ("mug", typed, "the longest side is")
            for typed in ("0", "-3", "inf", "nan", "1e9", "0.4", "1e-290", "9 cm", "0x10")
        ),
    ],
)
def test_what_is_no_name_or_size_is_refused_and_nothing_is_kept(
    outlining: Starlette, outlines: OutlineSession, name: object, longest_side_cm: object, why: str
) -> None:
    first = next(iter(outlines.photos))
    status, told = said(outlining, first, name, longest_side_cm)
    assert status == 400 and why in told["error"]
    outline = base64.b64encode(outlines.mask(first)).decode()
    sent = {"png": outline, "name": name, "longest_side_cm": longest_side_cm}
    assert answer_to(outlining, f"/outline/{first}", sent)[0] == 400
    assert outlines.restated_twins == outlines.outlined_keys == () and read_amendments(outlines.root, first) == {}


@pytest.mark.parametrize(
    ("raw", "why"),
    [
        (b"", "its JSON is broken"),
        (b"\xff\xfe", "what was sent"),
        (b'{"png": null, "name": "\\ud800", "longest_side_cm": null}', "its JSON is broken"),
        (b'{"png": null, "name": null}', "has other names than png, name, longest_side_cm"),
        (b'{"png": "%%", "name": null, "longest_side_cm": null}', "no outline in base64"),
        (b'{"png": 5, "name": null, "longest_side_cm": null}', "no outline in base64"),
        (b"[" * 100_000, "nested too deep"),
    ],
)
def test_what_no_page_sends_is_refused_in_words(
    outlining: Starlette, outlines: OutlineSession, raw: bytes, why: str
) -> None:
    first = next(iter(outlines.photos))
    status, told = answer_to(outlining, f"/outline/{first}", None, raw=raw)
    assert status == 400 and why in told["error"] and read_amendments(outlines.root, first) == {}


def test_unknown_name_is_kept_and_the_nearest_known_ones_are_told(
    outlining: Starlette, outlines: OutlineSession
) -> None:
    first = next(iter(outlines.photos))
    for name, told in (
        ("botle", "did you mean"),
        ("xyzzy", "name the kind of object, in English"),
        ("red mug", "known as: mug, "),
        ("", ""),
    ):
        status, answer = answer_to(outlining, "/name", {"name": name})
        assert status == 200 and told in answer["told"] and "--name" not in answer["told"]
    assert answer_to(outlining, "/name", {"name": "a\0"})[0] == 400
    assert said(outlining, first, "xyzzy")[0] == 200
    assert "the priors (docs/priors.md) know no &#x27;xyzzy&#x27;" in page_of(outlining, f"/outline/{first}")


def test_outline_that_a_name_would_have_of_another_picture_is_not_kept(tmp_path: Path) -> None:
    """A picture between transparent bars is one of a thing, or is the thing: the name says which, and what is looked at."""
    picture = Image.new("RGBA", (400, 400), (0, 0, 0, 0))
    picture.paste(Image.effect_noise((400, 240), 20).convert("RGBA"), (0, 80))
    picture.save(tmp_path / "barred.png")
    built = manitwin.build(tmp_path / "barred.png", tmp_path / "twins", config=DOUBTING, executor="inline").results[0]
    session = OutlineSession(DatasetRoot(tmp_path / "twins"), "ada")
    [key] = session.photos
    assert key == built.twin_id and not is_framed(session.picture(key))
    drawn = Image.new("L", (400, 400))
    drawn.paste(255, (150, 120, 250, 280))
    encoded = io.BytesIO()
    drawn.save(encoded, "PNG")
    refusal = r"not kept: as a 'mug' the picture is looked at without its frame"
    with pytest.raises(UsageError, match=refusal):
        session.store_outline(key, encoded.getvalue(), "mug")
    assert read_amendments(session.root, key) == {}
    session.store_outline(key, None, "mug")
    with pytest.raises(UsageError, match=refusal):
        session.store_outline(key, encoded.getvalue())
    session.store_outline(key, encoded.getvalue(), "book")
    assert session.outlined_keys == (key,) and session.words(key).name == "book"
    with pytest.raises(UsageError, match=refusal):
        session.store_outline(key, None, "mug")
    write_amendments(session.root, key, {})
    session.store_outline(key, None, "mug")
    session.build(jobs=1, executor="inline")
    again = OutlineSession(session.root, "ada", [key])
    assert is_framed(again.picture(key))


def is_framed(picture: bytes) -> bool:
    """Tell whether the bars were taken away from a picture of 400 x 400 pixels."""
    return Image.open(io.BytesIO(picture)).size == (400, 240)


@pytest.mark.slow
def test_nameless_photo_that_is_named_is_built_as_one_that_was_given_the_name(tmp_path: Path, doubted: Path) -> None:
    photo = doubted.parent / "photos" / "first.jpg"
    config = stored_config(DatasetRoot(doubted))
    nameless = manitwin.build(photo, tmp_path / "twins", config=config, executor="inline").results[0]
    assert nameless.status == "rejected"
    session = OutlineSession(DatasetRoot(tmp_path / "twins"), "ada")
    [key] = session.photos
    assert session.words(key).name == ""
    session.store_outline(key, session.mask(key), "bottle", "20")
    assert session.build(jobs=1, executor="inline").counts_of_given == {"accepted": 1}
    record = record_of(session.root, nameless.twin_id)
    assert record.name == "bottle" and record.naming is None and record.language is not None
    checks = checks_of(record)
    assert checks["named"] == (True, "human:ada says what it is")
    assert checks["size_known"] == (True, "human:ada says how long it is: 20 cm")
    folder = session.root.local / session.root.twin_name(key)  # type: ignore[operator]
    given = manitwin.build(
        folder / "source.jpg", tmp_path / "given", mask=folder / "source_mask.png", name="bottle", longest_side_m=0.2,
        config=config, executor="inline",
    ).results[0]  # fmt: skip
    assert given.folder is not None
    same = read_record(given.folder)
    assert same.physical == record.physical and same.language == record.language and same.points == record.points
    # a later build of the same input keeps to it, and the name alone can be said anew
    again = manitwin.build(photo, tmp_path / "twins", config=config, executor="inline").results[0]
    assert again.status == "accepted" and record_of(session.root, key).revision == record.revision
    later = OutlineSession(session.root, "ben", [key[:8]])
    assert vars(later.words(key)) == {"name": "bottle", "longest_side_cm": "20"}
    later.store_outline(key, None, "ketchup bottle")
    assert later.outlined_keys == () and later.build(jobs=1, executor="inline").counts_of_given == {"accepted": 1}
    renamed = record_of(session.root, key)
    assert renamed.name == "ketchup bottle" and checks_of(renamed)["named"][1] == "human:ben says what it is"
    assert "human:ada drew its outline" in checks_of(renamed)["matte"][1]
    assert max(renamed.physical.extents_m) == pytest.approx(0.2)  # type: ignore[union-attr]
    assert photos_to_draw(session.root) == []
