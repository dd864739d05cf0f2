"""Fixtures of the pages' tests: a data set and a run of episodes to look at, a real browser."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from doubted_photos import write_doubted
from starlette.applications import Starlette
from viewed_twins import write_viewed

from drawn_episodes import attempt, write_run
from manitwin.dataset.review.outlines import OutlineSession
from manitwin.models.matting import matte
from manitwin.models.matting.learned import Network
from manitwin.models.matting.study import Study, study_in_turn
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.web.outline_application import outline_application

BROWSERS = ("chromium", "chromium-browser", "google-chrome-stable", "google-chrome")


@pytest.fixture(scope="session")
def viewed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """A data set and the ids of its twins; nothing may write there."""
    root = tmp_path_factory.mktemp("viewed") / "set"
    return root, write_viewed(root)


@pytest.fixture
def place(viewed: tuple[Path, list[str]], tmp_path: Path) -> Path:
    """A copy of the data set, to write reviews and defects into."""
    return Path(shutil.copytree(viewed[0], tmp_path / "set"))


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two kept episodes and two failed attempts before them; nothing may write there."""
    failed = (
        attempt(
            7, outcome="goal_missed", goal="in(object_00, object_01)", failure="in(object_00, object_01): on_the_rim"
        ),
        attempt(8, outcome="no_plan", plan_failures='{"approach_blocked": 5}', length_s=None),
    )
    return write_run(tmp_path_factory.mktemp("run"), failed=failed)


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """A real Chromium; skips where none is installed, fails there with BROWSER_REQUIRED."""
    path = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if path is None:
        if os.environ.get("BROWSER_REQUIRED"):
            pytest.fail("no Chromium is installed; run make browser")
        pytest.skip("no Chromium is installed: make browser")
    from playwright.sync_api import sync_playwright

    drawn = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]  # WebGL without a GPU
    rebound = ["--host-resolver-rules=MAP evil.example 127.0.0.1"]
    sandbox = ["--no-sandbox"] if os.geteuid() == 0 else []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=[*drawn, *rebound, *sandbox])
        yield browser
        browser.close()


@pytest.fixture
def visitor(chromium: Any) -> Iterator[Callable[..., Any]]:
    """Return a new visitor's page by a call, which notes in ``requests`` and ``errors`` what it asks for and what fails."""
    contexts = []

    def come(**how: Any) -> Any:
        context = chromium.new_context(**{"viewport": {"width": 1280, "height": 900}, **how})
        contexts.append(context)
        page = context.new_page()
        page.requests, page.errors = [], []
        context.on("request", lambda request: page.requests.append(request.url))
        page.on("pageerror", lambda error: page.errors.append(str(error)))
        page.on("console", lambda said: page.errors.append(said.text) if said.type == "error" else None)
        return page

    yield come
    for context in contexts:
        context.close()


@pytest.fixture(scope="session", autouse=True)
def photos_studied_once() -> Iterator[None]:
    """Study a photo once a process: the same ones are built again and again, and what is found in one is always the same."""
    studies: dict[tuple[object, ...], Study] = {}

    def studied(rgb: np.ndarray, networks: Sequence[Network], **settings: float) -> Study:
        key = (hashlib.sha256(rgb.tobytes()).digest(), rgb.shape, *networks, *sorted(settings.items()))
        if key not in studies:
            studies[key] = study_in_turn(rgb, networks, **settings)  # type: ignore[arg-type]
        return studies[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(matte, "study_in_turn", studied)
        yield


@pytest.fixture(scope="session")
def doubted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set with photos whose cut-outs are doubted; nothing may write there."""
    return write_doubted(tmp_path_factory.mktemp("doubted"))


@pytest.fixture
def outlines(doubted: Path, tmp_path: Path) -> OutlineSession:
    """Outlines of a copy of that data set, to be drawn."""
    return OutlineSession(DatasetRoot(shutil.copytree(doubted, tmp_path / "twins")), "ada")


@pytest.fixture
def outlining(outlines: OutlineSession) -> Starlette:
    """The pages on which they are drawn."""
    return outline_application(outlines)
