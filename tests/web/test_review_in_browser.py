"""A review in a real Chromium: by keyboard alone, over reloads and kills, by several annotators, and blind."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from review_server import confirmed, correct_a_point, pick, press, reviewing, shown, stored
from typer.testing import CliRunner

from manitwin.cli.main import app

pytestmark = [pytest.mark.slow, pytest.mark.browser]
Visitor = Callable[..., Any]


def test_three_twins_by_keyboard_alone_a_reload_in_the_middle_and_undo(place: Path, visitor: Visitor) -> None:
    with reviewing(place, "ada") as server:
        page = visitor()
        page.goto(server.links["ada"])
        first = shown(page)
        assert "0 reviewed, 3 left" in page.inner_text("#progress") and "token" not in page.url
        press(page, "n", "c")
        page.keyboard.type("jug")
        press(page, "Escape", "2", "y", "y", "n", "c")
        page.keyboard.type("0.25")
        press(page, "Escape", "t")
        with page.expect_response(lambda reply: "y n u" in (reply.request.post_data or "")):
            page.keyboard.type("it is a jug, y n u")
        page.reload()
        assert shown(page) == first
        assert page.input_value("[data-fix=category]") == "jug" and page.input_value("textarea") == "it is a jug, y n u"
        press(page, "Enter")
        page.wait_for_selector(".said.error")
        assert page.inner_text("#saved") == "not answered: grasp, mesh, simulation"
        press(page, "y", "u", "y")
        confirmed(page)
        second = shown(page)
        [one] = stored(place)
        assert one.review.answers == {
            "category": "no", "language": "yes", "functional": "yes", "physical": "no", "grasp": "yes", "mesh": "unsure",
            "simulation": "yes",
        }  # fmt: skip
        assert one.review.corrections.category == "jug" and one.review.corrections.mass_kg is not None
        assert one.review.corrections.mass_kg.model_dump() == {"value": 0.25, "low": 0.25, "high": 0.25}
        assert one.review.note == "it is a jug, y n u" and 0 < (one.review.seconds or 0) < 300
        for _ in range(2):
            press(page, *"yyyyyyy")
            confirmed(page)
        assert "Nothing is left" in page.inner_text("main") and "3 reviewed, 0 left" in page.inner_text("#progress")
        assert len(stored(place)) == 3
        for _ in range(2):
            with page.expect_navigation():
                press(page, "Backspace")
            shown(page)
        assert [each.review.twin_id for each in stored(place)] == [first] and shown(page) == second
        assert page.is_checked("input[name=category][value=yes]"), "what was said is there again"
        confirmed(page)
        assert len(stored(place)) == 2
        assert page.errors == [] and not [
            url for url in page.requests if not url.startswith((server.address, "blob:", "data:"))
        ]


def test_keys_can_be_changed_and_never_clash(place: Path, visitor: Visitor) -> None:
    with reviewing(place, "ada") as server:
        page = visitor()
        page.goto(server.links["ada"])
        shown(page)
        page.get_by_text("Change the keys").click()  # no field of a closed list takes the focus
        page.focus("[data-map=yes]")
        press(page, "n")
        assert page.inner_text("#saved") == "n is taken already"
        press(page, "a")
        page.reload()
        shown(page)
        press(page, "y")
        assert page.locator("input[type=radio]:checked").count() == 0
        press(page, "a")
        assert page.is_checked("input[name=category][value=yes]")
        press(page, "1", "N")
        assert page.is_checked("input[name=category][value=no]"), "Caps Lock is on"
        page.get_by_text("Change the keys").click()
        page.focus("[data-map=confirm]")
        press(page, "x", "Escape", "x")
        page.wait_for_selector("#saved.error")
        with page.expect_navigation():
            press(page, "Shift+X")
        assert [each.review.answers for each in stored(place)] == [{"category": "no"}]


def test_a_server_killed_while_saving_loses_nothing_that_it_confirmed(place: Path, visitor: Visitor) -> None:
    with reviewing(place, "ada") as server:
        page = visitor()
        page.goto(server.links["ada"])
        shown(page)
        press(page, *"yyyyyyy")
        confirmed(page)
        second = shown(page)
        with page.expect_response(lambda reply: reply.url.endswith("/draft")):
            press(page, "n", "2", *"yyyyyy")
        # the answer never comes: the server dies when it has the review
        page.route("**/review/*", lambda route: (server.process.kill(), server.process.wait(), route.continue_()))
        press(page, "j", "Enter")
        page.wait_for_selector(".said.error")
        assert "the server does not answer" in page.inner_text("#saved")
    before = stored(place)
    assert len(before) == 1
    with reviewing(place, "ada") as server:
        page = visitor()
        page.goto(server.links["ada"])
        assert shown(page) == second and page.is_checked("input[name=category][value=no]"), "the draft is there"
        confirmed(page)
        assert [each.review.twin_id for each in stored(place)] == [before[0].review.twin_id, second]


def test_who_reviews_goes_on_when_the_server_has_started_again(place: Path, visitor: Visitor) -> None:
    with reviewing(place, "ada") as server:
        page = visitor()
        page.goto(server.links["ada"])
        first = shown(page)
        press(page, *"yyyyyyy")
    with reviewing(place, "ada") as server:
        assert page.url.startswith(server.address), "the port is the one that it had"
        confirmed(page)
        second = shown(page)
        assert [each.review.twin_id for each in stored(place)] == [first] and second != first
        unused = server.links["ada"]
    with reviewing(place, "ada") as server:
        other = visitor()
        other.goto(unused)
        assert shown(other) == second, "a link that nobody used is good still"
    with reviewing(place, "ada", more=("--revoke",)) as server:
        assert page.goto(f"{server.address}/review").status == 403
    text = (place / "reviews.access.json").read_text()
    assert "ada" in text and unused.split("token=")[1].split("&")[0] not in text


def test_two_annotators_disagree_and_nobody_sees_what_the_other_says(place: Path, visitor: Visitor) -> None:
    with reviewing(place, "ada", "ben", more=("--overlap", "1", "--blind")) as server:
        for name, answers in (("ada", "yyyyyyy"), ("ben", "nyyyyyy")):
            page = visitor()
            page.goto(server.links[name])
            for _ in range(3):
                twin = shown(page)
                assert "Physical properties" not in page.inner_text("body"), "blind: no sources and intervals"
                press(page, *answers, *("j" * 7))
                assert page.locator("input[type=radio]:checked").count() == 7 or answers[0] == "n"
                if answers[0] == "n":
                    press(page, "1", "n", "2", *"yyyyyy")
                confirmed(page)
            assert page.goto(f"{server.address}/twin/{twin}").status == 404
            assert page.goto(f"{server.address}/twin/{twin}/twin.json").status == 404
        stranger = visitor()
        assert stranger.goto(f"{server.address}/review").status == 403
    done = CliRunner().invoke(app, ["review", "report", str(place), "--json"])
    document = json.loads(done.stdout)
    category = document["dimensions"][0]
    assert (category["undecided"], category["agreement"]["items"], category["agreement"]["raw"]) == (3, 3, 0.0)
    assert len(document["disputed"]["category"]) == 3 and document["dimensions"][1]["agreement"]["raw"] == 1.0
    assert all(each.review.blind for each in stored(place))


def test_a_point_moves_to_the_candidate_that_is_clicked(place: Path, visitor: Visitor) -> None:
    with reviewing(place, "ada") as server:
        page = visitor()
        page.goto(server.links["ada"])
        shown(page)
        correct_a_point(page)
        pick(page, "c1")
        assert page.input_value("[data-point=f0]") == "1"
        assert "f0 belongs to candidate 1" in page.inner_text("#saved")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280])
def test_the_page_is_no_wider_than_the_screen(place: Path, visitor: Visitor, width: int, scheme: str) -> None:
    with reviewing(place, "ada") as server:
        page = visitor(viewport={"width": width, "height": 900}, color_scheme=scheme)
        page.goto(server.links["ada"])
        shown(page)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        if os.environ.get("SCREENSHOTS"):
            page.wait_for_selector("#viewer[data-ready]", timeout=30_000)
            press(page, "y", "2", "y", "n")
            page.screenshot(path=f"{os.environ['SCREENSHOTS']}/review_{width}_{scheme}.png", full_page=width < 500)
