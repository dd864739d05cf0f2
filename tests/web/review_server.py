"""A running ``manitwin review`` for tests of its pages in a browser, and what a person does there."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from manitwin.dataset.review.store import ReviewStore, Stored


class Reviewing:
    """A running ``manitwin review``: the links of its annotators."""

    def __init__(self, process: subprocess.Popen[str], count: int):
        self.process = process
        assert process.stdout is not None
        self.links: dict[str, str] = {}
        for line in process.stdout:
            if found := re.search(r"(http://\S+/enter\?\S+) .*for (\w+) alone", line):
                self.links[found[2]] = found[1]
            if len(self.links) == count:
                break
        self.address = next(iter(self.links.values())).split("/enter")[0]


@contextmanager
def reviewing(place: Path, *names: str, more: tuple[str, ...] = ()) -> Iterator[Reviewing]:
    command = [sys.executable, "-m", "manitwin", "review", str(place), "--no-browser", "--sample", "3", *more]
    command += [word for name in names for word in ("--annotator", name)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=dict(os.environ)) as process:
        try:
            yield Reviewing(process, len(names))
            process.send_signal(signal.SIGINT)
            assert process.wait(20) in (0, -signal.SIGKILL)
        finally:
            process.kill()


def stored(place: Path) -> list[Stored]:
    with ReviewStore(place / "reviews.sqlite") as store:
        return store.standing()


def shown(page: Any) -> str:
    page.wait_for_selector("#review[data-ready]")
    return str(page.get_attribute("#review", "data-twin"))


def press(page: Any, *keys: str) -> None:
    for key in keys:
        page.keyboard.press(key)


def confirmed(page: Any) -> None:
    """Press Enter and wait for the page that comes then."""
    with page.expect_navigation():
        press(page, "Enter")
    page.wait_for_selector("#review")


def correct_a_point(page: Any) -> None:
    """Say that the points are wrong and correct them, once the 3D view is there."""
    page.wait_for_selector("#viewer[data-ready]", timeout=30_000)
    press(page, "3", "n", "c")


def pick(page: Any, candidate: str) -> None:
    """Pick a candidate in the 3D view, as a click on it does."""
    picked = f"new CustomEvent('twin:picked', {{ bubbles: true, detail: '{candidate}' }})"
    page.evaluate(f"document.querySelector('.stage').dispatchEvent({picked})")
