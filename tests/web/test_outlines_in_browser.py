"""Outlines drawn in a real Chromium: with corners, a brush and keys; what was drawn is built when the command is ended."""

from __future__ import annotations

import io
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from doubted_photos import write_doubted
from PIL import Image

from manitwin.engine.amendments import read_amendments
from manitwin.pipeline.drawn_outline import drawn_outline
from manitwin.pipeline.photo import PhotoStage
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import read_record

pytestmark = [pytest.mark.slow, pytest.mark.browser]


def share_of(page: Any) -> float:
    """Return how much of the picture is not tinted, as the page shows it."""
    picture = np.asarray(Image.open(io.BytesIO(page.locator("#canvas").screenshot())).convert("RGB")).astype(int)
    tinted = (picture[..., 0] - picture[..., 1] > 60) & (picture[..., 2] - picture[..., 1] > 60)
    return float(1 - tinted.mean())


@contextmanager
def drawing(place: Path) -> Iterator[tuple[str, Callable[[], str]]]:
    """Yield the link of the pages for a data set's outlines, and a call that ends the command and returns what it prints."""
    command = [sys.executable, "-m", "manitwin", "review", "cutouts", str(place)]
    command += ["--draw", "--no-browser", "--jobs", "1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=dict(os.environ)) as process:
        try:
            output = process.stdout
            assert output is not None
            link = next(found[0] for line in output if (found := re.search(r"http://\S+/enter\?\S+", line)))

            def ended() -> str:
                process.send_signal(signal.SIGINT)
                told = output.read()
                assert process.wait(120) == 0
                return told

            yield link, ended
        finally:
            process.kill()


def test_corners_brush_undo_and_what_is_kept_is_built(tmp_path: Path, visitor: Callable[..., Any]) -> None:
    place = write_doubted(tmp_path)
    with drawing(place) as (link, ended):
        page = visitor()
        page.goto(link)
        page.click(".card a >> nth=0")
        page.wait_for_selector("#outline[data-ready]")
        first = page.url.rsplit("/", 1)[1]
        came = share_of(page)
        assert 0.02 < came < 0.8
        box = page.locator("#canvas").bounding_box()

        def at(x: float, y: float) -> tuple[float, float]:
            return box["x"] + x * box["width"], box["y"] + y * box["height"]

        page.keyboard.press("n")
        assert share_of(page) < 0.02
        for corner in ((0.25, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75)):
            page.mouse.click(*at(*corner))
        page.keyboard.press("Enter")
        page.mouse.move(*at(0.5, 1.1))
        assert abs(share_of(page) - 0.25) < 0.03
        page.keyboard.press("b")
        page.keyboard.press("x")
        page.mouse.move(*at(0.3, 0.5))
        page.mouse.down()
        page.mouse.move(*at(0.7, 0.5), steps=5)
        page.mouse.up()
        page.mouse.move(*at(0.5, 1.1))
        cut = share_of(page)
        assert cut < 0.245
        page.keyboard.press("z")
        assert share_of(page) > cut
        page.keyboard.down("h")
        assert share_of(page) > 0.98
        page.keyboard.up("h")
        with page.expect_response("**/fit"):
            page.keyboard.press("f")
        page.wait_for_function("document.getElementById('said').textContent.startsWith('fitted')")
        page.keyboard.press("r")
        assert abs(share_of(page) - came) < 0.02
        with page.expect_navigation():
            page.keyboard.press("Enter")
        page.wait_for_selector("#outline[data-ready]")
        assert page.url.rsplit("/", 1)[1] != first and "1 drawn, 2 left" in page.inner_text("#progress")
        page.keyboard.press("n")
        page.keyboard.press("Enter")
        page.wait_for_selector(".said.error")
        assert page.inner_text("#said") == "not kept: the outline is empty; draw it around the object"
        assert page.errors == ["Failed to load resource: the server responded with a status of 400 (Bad Request)"]
        assert "1 outlines are drawn by me: 1 accepted" in ended()
    root = DatasetRoot(place)
    drawn = drawn_outline(read_amendments(root, first)[PhotoStage.name], "first")
    assert drawn is not None and abs(drawn.mask.mean() - came) < 0.02
    assert read_record(place / root.twin_name(first).removeprefix("/")).status == "accepted"


def test_name_and_size_are_typed_by_key_kept_alone_or_with_an_outline_and_built(
    tmp_path: Path, visitor: Callable[..., Any]
) -> None:
    place = write_doubted(tmp_path)
    with drawing(place) as (link, ended):
        page = visitor()
        page.goto(link)
        page.click(".card a >> nth=0")
        page.wait_for_selector("#outline[data-ready]")
        first = page.url.rsplit("/", 1)[1]
        came = share_of(page)
        page.keyboard.press("c")
        assert page.input_value("#name") == "bottle"
        page.keyboard.type("bnxyzzy")  # letters that are keys elsewhere
        page.keyboard.press("Escape")
        assert page.evaluate("document.activeElement === document.body") and abs(share_of(page) - came) < 0.01
        page.wait_for_selector("#known:has-text('know no')")
        assert "'bnxyzzy'" in page.inner_text("#known")
        page.keyboard.press("l")
        page.keyboard.type("1e9")
        page.keyboard.press("Enter")
        page.keyboard.press("k")
        page.wait_for_selector(".said.error")
        assert page.inner_text("#said").startswith("not kept: the longest side is '1e9'; give centimetres")
        page.keyboard.press("c")
        page.keyboard.type("ketchup bottle")
        page.keyboard.press("Tab")
        page.keyboard.type("21,5")
        page.keyboard.press("Enter")
        page.keyboard.press("k")
        page.wait_for_selector("#said:has-text('name and size are kept')")
        assert page.input_value("#longest_side_cm") == "21.5"
        page.wait_for_selector("#known:has-text('known as: ')")
        page.keyboard.press("c")
        page.keyboard.type("squeeze bottle")
        page.keyboard.press("Enter")
        with page.expect_navigation():
            page.keyboard.press("Enter")
        page.wait_for_selector("#outline[data-ready]")
        assert page.url.rsplit("/", 1)[1] != first and page.input_value("#name") == "water bottle"
        page.goto(page.url.rsplit("/", 2)[0] + "/")
        assert "squeeze bottle" in page.inner_text(".card >> nth=0")
        assert page.errors == ["Failed to load resource: the server responded with a status of 400 (Bad Request)"]
        assert "1 outlines are drawn, 1 things are named or measured, by me: 1 accepted" in ended()
    root = DatasetRoot(place)
    record = read_record(place / root.twin_name(first).removeprefix("/"))
    assert record.name == "squeeze bottle" and record.physical is not None
    assert abs(max(record.physical.extents_m) - 0.215) < 1e-6
    assert [check.message for check in record.quality.checks if check.name == "named"] == ["human:me says what it is"]
