"""An episode's page in a real Chromium: it plays, every state can be reached, and a link shows the same moment again."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from served_view import serving

from drawn_episodes import GRASPED, RELEASED, STEPS, attempt, stored, write_run
from drawn_scenes import write_scenes
from manitwin.web.static_pages import write_static_pages

pytestmark = [pytest.mark.slow, pytest.mark.browser]

HOSTILE = "<img src=x onerror=alert(1)> move the can"


@pytest.fixture
def run(tmp_path: Path) -> Path:
    write_scenes(tmp_path)
    said = (HOSTILE, "put it down further left")
    failed = (attempt(7, outcome="goal_missed", failure="in(object_00, object_01): on_the_rim"),)
    return write_run(tmp_path, [stored(tmp_path, number, instructions=said) for number in range(2)], failed)


def opened(page: Any, link: str) -> Any:
    """Open the first episode from the list, and return its 3D view."""
    assert page.goto(link).status == 200
    page.get_by_role("link", name="episode-00000000").click()
    page.wait_for_selector("#viewer[data-ready]", timeout=60_000)
    return page.locator(".stage")


def pixels(stage: Any) -> np.ndarray:
    """Return what a 3D view shows, without its frame, once it is drawn."""
    stage.page.mouse.move(0, 0)
    stage.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return np.asarray(Image.open(io.BytesIO(stage.screenshot())).convert("RGB"), float)[8:-8, 8:-8]


def changed(one: np.ndarray, other: np.ndarray) -> int:
    """Return how many pixels are clearly of another colour."""
    return int((np.abs(one - other).max(axis=2) > 30).sum())


def test_an_episode_is_played_stepped_and_handed_on(visitor: Callable[..., Any], run: Path) -> None:
    with serving(run) as server:
        page = visitor()
        stage = opened(page, server.link)
        slider, time = page.locator(".player input"), page.locator("output")
        assert time.inner_text() == "0.00 / 1.20 s" and slider.get_attribute("max") == str(STEPS)
        first = pixels(stage)
        assert first.std() > 5
        stage.press(".")
        assert time.inner_text().startswith("0.05 ")
        stage.press("End")
        assert slider.input_value() == str(STEPS) and changed(pixels(stage), first) > 300  # the can is elsewhere
        page.get_by_role("button", name="grasped object_00 (can)").click()
        assert slider.input_value() == str(GRASPED) and "31.0 N" in page.locator(".readout").inner_text()
        assert "70.0 mm" in page.locator(".readout").inner_text()
        held = pixels(stage)
        assert changed(held, first) > 2_000  # the arm has moved
        page.reload()
        page.wait_for_selector("#viewer[data-ready]", timeout=60_000)
        assert slider.input_value() == str(GRASPED)
        assert np.abs(pixels(stage) - held).mean() < 1.0  # the address has millimetres
        stage.press("r")
        assert "robot" not in page.url.partition("layers=")[2] and changed(pixels(stage), held) > 2_000
        stage.press("Home")
        page.locator('[data-act="speed"]').select_option("4")
        page.get_by_role("button", name="Play").click()
        page.wait_for_function(f"() => document.querySelector('.player input').value === '{STEPS}'", timeout=30_000)
        page.get_by_role("button", name="Play", exact=True).wait_for()
        assert page.errors == []


def test_the_timeline_leads_to_a_moment_and_fits_a_telephone(visitor: Callable[..., Any], run: Path) -> None:
    with serving(run) as server:
        page = visitor(viewport={"width": 390, "height": 844}, color_scheme="dark")
        opened(page, server.link)
        chart = page.locator(".timeline svg")
        box = chart.bounding_box()
        chart.scroll_into_view_if_needed()
        chart.click(position={"x": box["width"] * RELEASED / STEPS, "y": box["height"] / 2})
        assert page.locator(".player input").input_value() == str(RELEASED)
        assert page.locator("output").inner_text().startswith("1.00 ")
        assert page.evaluate("() => document.documentElement.scrollWidth") <= 390
        assert page.locator(".timeline .mark").count() == 4
        assert page.errors == []


def test_words_of_an_episode_run_nothing(visitor: Callable[..., Any], run: Path) -> None:
    with serving(run) as server:
        page = visitor()
        opened(page, server.link)
        assert page.locator(".caption").inner_text() == HOSTILE and page.locator("img").count() == 0
        page.get_by_role("link", name="All episodes").click()
        assert page.get_by_role("cell", name=HOSTILE).count() == 2
        assert page.get_by_role("cell", name="in(object_00, object_01): on_the_rim").count() == 1
        assert page.errors == []
        assert all(each.startswith(server.address) for each in page.requests if not each.startswith(("blob:", "data:")))


def test_plain_files_of_episodes_play_from_the_disk(visitor: Callable[..., Any], run: Path, tmp_path: Path) -> None:
    write_static_pages(str(run), tmp_path / "out")
    page = visitor()
    page.goto((tmp_path / "out" / "index.html").as_uri())
    page.get_by_role("link", name="episode-00000000").click()
    page.wait_for_selector("#viewer[data-ready]", timeout=60_000)
    stage = page.locator(".stage")
    first = pixels(stage)
    stage.press("End")
    assert "1.20 / 1.20 s" in page.inner_text("output") and changed(first, pixels(stage)) > 200
    assert "Drag to turn" in page.inner_text(".said") and page.title().count("img") == 0
    assert page.errors == [] and not [url for url in page.requests if not url.startswith(("file://", "blob:", "data:"))]
