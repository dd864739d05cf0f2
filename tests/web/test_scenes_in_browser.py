"""A scene's page in a real Chromium: what is drawn answers to the pointer, and a link shows the same view again."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from served_view import serving

from drawn_scenes import write_scenes
from manitwin.scenes.scene_files import scene_files
from manitwin.web.static_pages import write_static_pages

pytestmark = [pytest.mark.slow, pytest.mark.browser]


def pixels(stage: Any) -> np.ndarray:
    """Return what a 3D view shows, without its frame, once it is drawn."""
    stage.page.mouse.move(0, 0)
    stage.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return np.asarray(Image.open(io.BytesIO(stage.screenshot())).convert("RGB"), float)[8:-8, 8:-8]


def test_a_scene_is_turned_pointed_at_and_handed_on(visitor: Callable[..., Any], tmp_path: Path) -> None:
    scenes = write_scenes(tmp_path)
    with serving(scenes) as server:
        page = visitor()
        assert page.goto(server.link).status == 200
        page.get_by_role("link", name=scene_files(scenes)[0].parent.name).click()
        page.wait_for_selector("#viewer[data-ready]", timeout=30_000)
        stage = page.locator(".stage")
        box = stage.bounding_box()
        told = set()
        for across in range(1, 12):
            for down in range(1, 12):
                page.mouse.move(box["x"] + across * box["width"] / 12, box["y"] + down * box["height"] / 12)
                if page.locator(".tip").is_visible():
                    told.add(page.locator(".tip").inner_text().split(":")[-1].strip())
        assert any(each.startswith("can, on") for each in told) and "board" in told
        stage.press("ArrowLeft")
        stage.press("h")
        assert "hulls" in page.url and "from=" in page.url
        before = pixels(stage)
        page.reload()
        page.wait_for_selector("#viewer[data-ready]", timeout=30_000)
        assert page.locator('[data-layer="hulls"]').is_checked()
        assert np.abs(pixels(stage) - before).mean() < 1.0  # the address has millimetres
        stage.press("ArrowLeft")
        assert np.abs(pixels(stage) - before).mean() > 2.0
        assert page.errors == []


def test_plain_files_of_scenes_open_from_the_disk_with_their_twins(visitor: Callable[..., Any], tmp_path: Path) -> None:
    write_static_pages(str(write_scenes(tmp_path)), tmp_path / "out")
    page = visitor()
    page.goto((tmp_path / "out" / "index.html").as_uri())
    page.locator("tbody a").first.click()
    page.wait_for_selector("#viewer[data-ready]", timeout=60_000)
    assert "Drag to turn" in page.inner_text(".said") and pixels(page.locator(".stage")).std() > 5
    page.locator("main tbody a").first.click()
    page.wait_for_selector("#viewer[data-ready]", timeout=60_000)
    assert "Drag to turn" in page.inner_text(".said") and page.locator(".trial").count() == 0
    assert page.errors == [] and not [url for url in page.requests if not url.startswith(("file://", "blob:", "data:"))]
