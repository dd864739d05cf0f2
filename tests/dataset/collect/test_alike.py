"""Near-duplicates of a catalogue: the same photo in another size, the same mesh in another unit and format."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from typer.testing import CliRunner

from manitwin.cli.main import app
from manitwin.dataset.collect.intake import DefaultValues, add_inputs
from manitwin.dataset.collect.looks import SHAPE, shape_feature, similarity
from manitwin.dataset.collect.near_duplicates import mark_near_duplicates
from manitwin.dataset.collect.schema import APPLICATION, MIGRATIONS

MINE = DefaultValues(source="mine", licence="CC0-1.0")


def photo(seed: int) -> Image.Image:
    """A picture of blobs in colours of its own."""
    rng = np.random.default_rng(seed)
    small = Image.fromarray(rng.integers(0, 255, (6, 6, 3), np.uint8))
    return small.resize((320, 240), Image.Resampling.BICUBIC)


def solid() -> trimesh.Trimesh:
    parts = [trimesh.creation.box((0.12, 0.05, 0.03)), trimesh.creation.cylinder(0.02, 0.1)]
    return trimesh.util.concatenate(parts)


@pytest.fixture
def inputs(tmp_path: Path) -> Path:
    folder = tmp_path / "inputs"
    folder.mkdir()
    photo(1).save(folder / "a_first.png")
    photo(2).save(folder / "b_other.png")
    photo(1).resize((200, 150)).save(folder / "c_smaller.jpg", quality=70)
    solid().export(folder / "d_solid.stl")
    trimesh.creation.box((0.1, 0.1, 0.1)).export(folder / "e_box.stl")
    turned = solid()
    turned.apply_transform(trimesh.transformations.rotation_matrix(1.1, (1, 2, 3)))
    turned.apply_scale(1000)
    turned.export(folder / "f_turned.obj")
    (folder / "g_broken.png").write_bytes(b"no picture")
    return folder


def states(catalogue: Path) -> dict[str, tuple[str, int | None]]:
    with closing(sqlite3.connect(catalogue)) as connection:
        found = connection.execute("SELECT place, status, duplicate_of FROM inputs").fetchall()
    return {Path(place).name[0]: (status, of) for place, status, of in found}


def test_what_looks_like_an_earlier_input_is_its_duplicate(inputs: Path, tmp_path: Path) -> None:
    catalogue = tmp_path / "c.db"
    add_inputs(catalogue, inputs, MINE)
    assert mark_near_duplicates(catalogue) == {"picture": 1, "shape": 1}
    found = states(catalogue)
    assert found["c"] == ("duplicate", 1) and found["f"] == ("duplicate", 4)
    assert all(found[name] == ("ready", None) for name in "abdeg")
    assert mark_near_duplicates(catalogue) == {"picture": 1, "shape": 1}, "the same again"
    add_inputs(catalogue, inputs, MINE)
    assert states(catalogue) == found, "adding again leaves them"


def test_what_it_looked_like_is_gone_and_it_is_ready_again(inputs: Path, tmp_path: Path) -> None:
    catalogue = tmp_path / "c.db"
    add_inputs(catalogue, inputs, MINE)
    mark_near_duplicates(catalogue)
    photo(7).save(inputs / "a_first.png")
    add_inputs(catalogue, inputs, MINE)
    mark_near_duplicates(catalogue)
    assert states(catalogue)["c"] == ("ready", None)


def test_the_command_says_how_many(inputs: Path, tmp_path: Path) -> None:
    done = CliRunner().invoke(
        app, ["collect", "add", str(tmp_path / "c.db"), str(inputs), "--source", "mine", "--alike"]
    )
    assert done.exit_code == 0 and "2 look like an earlier input: 1 by picture, 1 by shape" in done.stdout


def test_shapes_are_alike_in_any_turn_and_size_and_others_are_not() -> None:
    turned = solid()
    turned.apply_transform(trimesh.transformations.rotation_matrix(0.7, (3, 1, 2)))
    looks = np.array(
        [
            shape_feature(each)
            for each in (turned.subdivide(), trimesh.creation.icosphere(), trimesh.creation.box((3, 2, 1)))
        ]
    )
    near = similarity(shape_feature(solid()), looks, SHAPE)
    assert near[0] > 0.999 and near[1] == 0 and near[2] < 0.95


def test_a_catalogue_of_before_looks_is_brought_on(inputs: Path, tmp_path: Path) -> None:
    catalogue = tmp_path / "old.db"
    with closing(sqlite3.connect(catalogue)) as connection:
        connection.executescript(f"{MIGRATIONS[0]} PRAGMA application_id = {APPLICATION}; PRAGMA user_version = 1;")
    add_inputs(catalogue, inputs, MINE)
    with closing(sqlite3.connect(catalogue)) as connection:
        assert connection.execute("PRAGMA user_version").fetchone() == (len(MIGRATIONS),)
        assert connection.execute("SELECT count(*) FROM looks").fetchone() == (0,)
