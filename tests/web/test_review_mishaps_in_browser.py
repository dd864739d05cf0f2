"""A review in a real Chromium where something is amiss: numbers that are none, keys in haste, twins that cannot be read."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from review_server import confirmed, correct_a_point, pick, press, reviewing, shown, stored

from manitwin.twin.dataset_root import twin_name
from manitwin.twin.store import RECORD, write_twin_record

pytestmark = [pytest.mark.slow, pytest.mark.browser]
Visitor = Callable[..., Any]
MASS = "[data-fix='mass_kg.value']"


def test_a_number_with_a_comma_is_read_and_what_is_none_is_not_left_out(place: Path, visitor: Visitor) -> None:
    with reviewing(place, "ada") as server:
        page = visitor()
        page.goto(server.links["ada"])
        shown(page)
        press(page, *"yyyn", "5", *"yyy", "4", "c")
        page.keyboard.type("1e")
        press(page, "Escape", "Enter")
        page.wait_for_selector("#saved.error")
        assert page.inner_text("#saved") == 'mass, value: "1e" is no number; give one such as 0.25'
        assert stored(place) == [] and page.evaluate("document.activeElement.dataset.fix") == "mass_kg.value"
        with page.expect_response(lambda reply: '"0,25"' in (reply.request.post_data or "")):
            page.fill(MASS, "0,25")
        page.reload()
        shown(page)
        assert page.input_value(MASS) == "0,25", "a draft has it as it was typed"
        press(page, "3", "n", "c")
        page.keyboard.type("1.5")
        press(page, "Escape", "Enter")
        page.wait_for_selector("#saved.error")
        assert "no candidate's number" in page.inner_text("#saved") and "f0" in page.inner_text("#saved")
        press(page, "Escape", "3", "y")
        confirmed(page)
    [one] = stored(place)
    assert one.review.corrections.mass_kg is not None and one.review.corrections.mass_kg.value == 0.25


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (390, 844)])
def test_what_went_wrong_is_in_sight(place: Path, visitor: Visitor, width: int, height: int) -> None:
    with reviewing(place, "ada") as server:
        page = visitor(viewport={"width": width, "height": height})
        page.goto(server.links["ada"])
        shown(page)
        if width < 500:
            page.locator("[data-dimension=category]").scroll_into_view_if_needed()
        press(page, "y", "Enter")
        page.wait_for_selector("#saved.error")
        area = page.locator("#saved").bounding_box()
        assert area["y"] >= 0 and area["y"] + area["height"] <= height
        page.route("**/review/*", lambda route: None)  # no answer comes
        press(page, "Shift+Enter")
        page.wait_for_function("document.getElementById('saved').textContent === 'not saved yet …'")
        assert stored(place) == []


def test_who_is_in_haste_loses_nothing_and_what_is_left_for_later_comes_last(place: Path, visitor: Visitor) -> None:
    with reviewing(place, "ada") as server:
        page = visitor()
        page.goto(server.links["ada"])
        first = shown(page)
        with page.expect_navigation():
            press(page, "n", "s")
        second = shown(page)
        press(page, *"yyyyyyy")
        confirmed(page)
        third = shown(page)
        assert len({first, second, third}) == 3, "what was left for later does not come next"
        with page.expect_navigation():
            press(page, "n", "Backspace")
        assert shown(page) == second
        confirmed(page)
        assert shown(page) == third and page.is_checked("input[name=category][value=no]")
        press(page, "1", *"yyyyyyy")
        confirmed(page)
        assert shown(page) == first and page.is_checked("input[name=category][value=no]")


def test_after_a_candidate_is_clicked_the_keys_are_those_of_the_review(place: Path, visitor: Visitor) -> None:
    with reviewing(place, "ada") as server:
        page = visitor()
        page.goto(server.links["ada"])
        shown(page)
        correct_a_point(page)
        page.locator(".stage").focus()
        pick(page, "c1")
        press(page, "4", "u")
        assert page.input_value("[data-point=f0]") == "1" and page.is_checked("input[name=physical][value=unsure]")


def test_all_that_is_judged_is_in_sight_without_a_mouse(place: Path, visitor: Visitor) -> None:
    with reviewing(place, "ada") as server:
        page = visitor(viewport={"width": 390, "height": 844})
        page.goto(server.links["ada"])
        shown(page)
        page.evaluate(
            "document.querySelector('[data-dimension=language] .given').textContent = 'a long caption '.repeat(60)"
        )
        press(page, "2")
        assert page.evaluate("""(() => { const given = document.querySelector('.current .given');
            return given.scrollHeight <= given.clientHeight + 1; })()""")


def test_two_links_in_one_browser_mix_no_names(place: Path, visitor: Visitor) -> None:
    with reviewing(place, "ada", "ben") as server:
        page = visitor()
        page.goto(server.links["ada"])
        shown(page)
        other = page.context.new_page()
        other.goto(server.links["ben"])
        shown(other)
        for keys in (("y",), (*"yyyyyy", "Enter"), ("Backspace",)):
            press(page, *keys)
            page.wait_for_selector("#saved.error")
            assert "this browser has been ben's" in page.inner_text("#saved")
        assert stored(place) == []
        press(other, *"yyyyyyy")
        confirmed(other)
        assert [each.review.annotator for each in stored(place)] == ["ben"]


def test_a_twin_that_cannot_be_read_keeps_nobody_from_the_others(place: Path, visitor: Visitor) -> None:
    with reviewing(place, "ada") as server:
        page = visitor()
        page.goto(server.links["ada"])
        gone = shown(page)
        record = place / twin_name(gone) / RECORD
        kept = record.read_bytes()
        record.write_text("{")
        assert page.goto(f"{server.address}/review/{gone}").status == 422 and "JSON" in page.inner_text("[role=alert]")
        page.click("text=The first page")
        for _ in range(2):
            assert shown(page) != gone
            press(page, *"yyyyyyy")
            confirmed(page)
        said = page.inner_text("main")
        assert "Nothing else is left" in said and "1 twin cannot be read" in said and gone in said
        record.write_bytes(kept)
        page.reload()
        assert shown(page) == gone


def test_a_blind_review_has_the_photo_and_neither_intervals_nor_the_card(place: Path, visitor: Visitor) -> None:
    for folder in place.glob("twins/*/*/"):
        record = json.loads((folder / RECORD).read_bytes())
        if record["status"] == "accepted":
            (folder / "source.png").write_bytes((folder / "card.png").read_bytes())
            record["source"]["file"] = "source.png"
            del record["revision"], record["files"]
            write_twin_record(folder, record)
    with reviewing(place, "ada", more=("--blind",)) as server:
        page = visitor()
        page.goto(server.links["ada"])
        shown(page)
        assert " to " not in page.inner_text("[data-dimension=physical] .given")
        assert page.locator("figure.card").count() == 0 and page.locator("figure.source").count() == 1
        page.locator("figure").last.scroll_into_view_if_needed()
        page.wait_for_function(
            """[...document.querySelectorAll('figure img')].every((each) => each.naturalWidth > 0)"""
        )
        assert page.errors == []
