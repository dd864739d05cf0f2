"""The pictures of README and docs are those of the code: made again, they are of the same twins, scenes and episode."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from PIL import Image

import manitwin
from manitwin.episodes.skills.registry import skill_names
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.render.false_colors import NOTHING_RGB, depth_in_colors, id_color

DOCS = Path(__file__).resolve().parent.parent / "docs"
PICTURES = sorted(path for path in DOCS.rglob("*") if path.suffix in (".png", ".webp"))
MADE_OF = {"cards.png": {"mug", "bottle"}, "layouts.png": {"table", "tray", "shelf"}, "episode.png": {"episode"}}
MEAN_DIFFERENCE = 1.5
"""Of 255. Another Vulkan driver draws edges otherwise; another gripper, label or colour is more than that."""


@pytest.fixture(scope="module", autouse=True)
def programs_of_the_docs() -> Iterator[None]:
    sys.path.insert(0, str(DOCS))
    yield
    sys.path.remove(str(DOCS))


@pytest.fixture(scope="module")
def make_pictures() -> ModuleType:
    import make_pictures

    return make_pictures


@pytest.fixture(scope="module")
def make_data_pictures() -> ModuleType:
    import make_data_pictures

    return make_data_pictures


@pytest.fixture(scope="module")
def twins(make_pictures: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> list[manitwin.Twin]:
    made: list[manitwin.Twin] = make_pictures.sample_twins(tmp_path_factory.mktemp("samples"))
    return made


def assert_same(made: Image.Image, name: str) -> None:
    shown = np.asarray(Image.open(DOCS / name).convert("RGB"), float)
    again = np.asarray(made.convert("RGB"), float)
    assert shown.shape == again.shape, f"docs/{name} is of an older code: make it again"
    assert np.abs(shown - again).mean() < MEAN_DIFFERENCE, f"docs/{name} is of an older code: make it again"


def made_of(name: str) -> dict[str, str]:
    from picture_file import made_of

    found: dict[str, str] = made_of(DOCS / name)
    return found


@pytest.mark.parametrize("picture", PICTURES, ids=lambda path: path.name)
def test_pictures_are_small(picture: Path) -> None:
    assert picture.stat().st_size < 1_000_000


@pytest.mark.parametrize("name", MADE_OF)
def test_pictures_of_twins_say_what_they_show(name: str) -> None:
    assert set(made_of(name)) == MADE_OF[name]
    assert all(len(digest) == 16 for digest in made_of(name).values())


def test_every_skill_has_a_film_of_an_episode_that_moves() -> None:
    said = json.loads((DOCS / "films" / "films.json").read_text())
    assert set(said) == set(skill_names()) == {path.stem for path in (DOCS / "films").glob("*.webp")}
    for skill, told in said.items():
        assert len(told["episode"]) == 16
        with Image.open(DOCS / "films" / f"{skill}.webp") as film:
            assert film.n_frames > 4 * told["seconds"] * 0.9, "every fifth of 20 states a second"
            first = np.asarray(film.convert("RGB"), float)
            film.seek(film.n_frames // 2)
            assert np.abs(np.asarray(film.convert("RGB"), float) - first).mean() > 1
    text = (DOCS / "skills.md").read_text()
    assert all(f"(films/{skill}.webp)" in text for skill in said)


def test_layouts_show_depth_and_ids_in_the_colours_of_previews(make_data_pictures: ModuleType) -> None:
    shown, size = np.asarray(Image.open(DOCS / "layouts.png").convert("RGB")), make_data_pictures.TILE_PX
    ramp = np.linspace(0.0, 1.0, 4096)[None] + 1e-6
    colors = {
        2: {NOTHING_RGB, *map(tuple, depth_in_colors(ramp, (0.0, 1.0))[0].tolist())},
        4: {id_color(number) for number in range(32)},
    }
    for column, allowed in colors.items():
        left = column * (size + 4)
        for top in range(0, len(shown), size + 4):
            tile = shown[top : top + size, left : left + size].reshape(-1, 3)
            assert {*map(tuple, np.unique(tile, axis=0).tolist())} <= allowed


@pytest.mark.slow
def test_templates_are_those_of_the_code() -> None:
    from make_templates_picture import templates_picture

    assert_same(templates_picture(), "templates.webp")


def test_every_template_is_in_the_picture_of_them() -> None:
    from make_templates_picture import COLUMNS, LABEL_PX, TILE_PX

    with Image.open(DOCS / "templates.webp") as picture:
        width, height = picture.size
    shown = np.asarray(Image.open(DOCS / "templates.webp").convert("L"))[-LABEL_PX:]
    last = len(load_templates()) - height // (TILE_PX + LABEL_PX) * COLUMNS + COLUMNS
    assert width == COLUMNS * TILE_PX and 0 < last <= COLUMNS
    named = [shown[:, at : at + TILE_PX].min() < 200 for at in range(0, width, TILE_PX)]
    assert named == [at < last for at in range(COLUMNS)]


@pytest.mark.slow
def test_cards_are_those_of_the_samples(make_pictures: ModuleType, twins: list[manitwin.Twin]) -> None:
    assert made_of("cards.png") == make_pictures.made_of_twins(twins)
    assert_same(make_pictures.cards_picture(twins), "cards.png")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["frames", "grippers", "questions"])
def test_drawings_are_those_of_the_code(make_pictures: ModuleType, name: str) -> None:
    assert_same(getattr(make_pictures, f"{name}_picture")(), f"{name}.png")


@pytest.mark.slow
def test_layouts_are_those_of_the_code(
    make_data_pictures: ModuleType, twins: list[manitwin.Twin], tmp_path: Path
) -> None:
    picture, scenes = make_data_pictures.layouts(twins[0].folder.parents[2], tmp_path)
    assert made_of("layouts.png") == scenes
    assert_same(picture, "layouts.png")


@pytest.mark.slow
def test_episode_is_that_of_the_code(
    make_data_pictures: ModuleType, twins: list[manitwin.Twin], tmp_path: Path
) -> None:
    episode = make_data_pictures.an_episode(twins[0].folder.parents[2], tmp_path)
    assert made_of("episode.png") == {"episode": make_data_pictures.of_episode(episode)}
    assert_same(make_data_pictures.episode_picture(episode, twins[0].folder.parents[2]), "episode.png")
