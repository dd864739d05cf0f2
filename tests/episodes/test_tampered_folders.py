"""Folders of scenes and episodes that somebody altered: each file, each damage, all that reads them. One line."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import sqlite3
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from publishable_run import write_run, write_twins

import manitwin
import manitwin.cli.main as main_module
from grasped_twins import write_brick
from manitwin.cli.causes import read_causes
from manitwin.episodes.attempts import ATTEMPTS, read_attempts
from manitwin.episodes.collect import batch_folders, collect, stored_episodes
from manitwin.episodes.episode_pictures import render_batches
from manitwin.episodes.episodes_run import make_episodes
from manitwin.episodes.lerobot.read import read_lerobot
from manitwin.episodes.publication.publish import publish_episodes
from manitwin.episodes.settings import PicturesConfig, TrajectoriesConfig
from manitwin.errors import ManiTwinError
from manitwin.scenes.layouts.layouts_run import layout_totals, make_layouts
from manitwin.scenes.settings import LayoutsConfig, LayoutSettings

CANARY = "CANARY-51d0e7"
LONGEST_S = 30
SAMPLED = 10
SLOW = frozenset({"make_episodes", "draw_episodes"})
"""These make again what they find damaged, which takes seconds."""
LAYOUTS = LayoutsConfig(seed=2, layout=LayoutSettings(objects=(2, 2), robot="panda"))
EPISODES = TrajectoriesConfig(seed=5, batch=1)
Case = tuple[str, str, str]
PLACES = ("scenes", "episodes", "run", "published")


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Bricks, two scenes of them, two episodes with them, a run with films, and its publication."""
    root = tmp_path_factory.mktemp("sound")
    for number in range(3):
        write_brick(root / "bricks", number)
    assert make_layouts(root / "bricks", root / "scenes", 2, LAYOUTS, executor="inline").exit_code == 0
    assert make_episodes(root / "bricks", root / "episodes", 2, EPISODES, executor="inline").exit_code == 0
    collect(root / "episodes", ["lerobot", "maniskill"])
    write_twins(root / "cups")
    write_run(root / "run", root / "cups", drawn=True)
    publish_episodes(root / "run", root / "published")
    return root


class Hangs(BaseException):
    """No error that a reader might take for one of the file."""


@contextmanager
def not_longer() -> Iterator[None]:
    def ring(number: int, frame: object) -> None:
        raise Hangs(f"more than {LONGEST_S} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(LONGEST_S)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def replaced(path: Path, make: Callable[[], object]) -> None:
    path.unlink()
    make()


def outside(path: Path) -> Path:
    return next(folder for folder in path.parents if (folder / "secret").exists()) / "secret"


def other_json(path: Path, change: Callable[[Any], Any]) -> None:
    """Change all that a JSON or JSON Lines file holds; text into any other file."""

    def changed(value: Any) -> Any:
        if isinstance(value, dict):
            return {name: changed(each) for name, each in value.items()}
        return [changed(each) for each in value] if isinstance(value, list) and value else change(value)

    try:
        text = path.read_text()
        documents = [json.loads(each) for each in ([text] if path.suffix == ".json" else text.splitlines())]
    except ValueError:
        documents = [change("text"), change(1)]
    path.write_text("\n".join(json.dumps(changed(each)) for each in documents))


def other_table(path: Path) -> None:
    pq.write_table(pa.table({"a": [1, 2], "../b": ["../../secret", None]}), path)


def altered_columns(path: Path, change: Callable[[pa.Array], pa.Array]) -> None:
    """Give each column of a Parquet file other values of its own type; elsewhere write a table."""
    if path.suffix != ".parquet":
        return other_table(path)
    table = pq.read_table(path)
    pq.write_table(pa.table([change(column.combine_chunks()) for column in table.columns], schema=table.schema), path)
    return None


def huge(column: pa.Array) -> pa.Array:
    kind = column.type
    if pa.types.is_floating(kind):
        return pa.array([1e30] * len(column), kind)
    if pa.types.is_integer(kind):
        return pa.array([2**31 - 1 if kind.bit_width == 32 else 2 ** (kind.bit_width - 1) - 1] * len(column), kind)
    return pa.array(["../../secret"] * len(column), kind) if pa.types.is_string(kind) else column


def outer_hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["traj_0"] = h5py.ExternalLink(str(outside(path)), "/")
        file.create_dataset("wide", shape=(1 << 40,), dtype="f8", chunks=(1 << 16,), compression="gzip")


def altered_hdf5(path: Path) -> None:
    """Give each array of an HDF5 file huge values; elsewhere write one."""
    if path.suffix != ".h5":
        return outer_hdf5(path)

    def change(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiu" and item.shape:
            item[...] = np.full(item.shape, 1e30 if item.dtype.kind == "f" else np.iinfo(item.dtype).max, item.dtype)

    with h5py.File(path, "r+") as file:
        file.visititems(change)
    return None


def other_database(path: Path) -> None:
    path.unlink()
    connection = sqlite3.connect(path)
    connection.executescript("CREATE TABLE items (number, state); INSERT INTO items VALUES ('x', '../../secret')")
    connection.close()


DAMAGES: dict[str, Callable[[Path], object]] = {
    "truncated": lambda path: os.truncate(path, path.stat().st_size // 2),
    "last byte": lambda path: os.truncate(path, max(0, path.stat().st_size - 1)),
    "emptied": lambda path: os.truncate(path, 0),
    "removed": lambda path: path.unlink(),
    "zeros": lambda path: path.write_bytes(b"\0" * path.stat().st_size),
    "bytes turned": lambda path: path.write_bytes(bytes(255 - byte for byte in path.read_bytes())),
    "a pipe": lambda path: replaced(path, lambda: os.mkfifo(path)),
    "a link out": lambda path: replaced(path, lambda: path.symlink_to(outside(path))),
    "a device": lambda path: replaced(path, lambda: path.symlink_to("/dev/zero")),
    "a loop": lambda path: replaced(path, lambda: path.symlink_to(path.name)),
    "a folder": lambda path: replaced(path, path.mkdir),
    "deep": lambda path: path.write_text("[" * 200_000),
    "long integer": lambda path: path.write_text('{"schema_version": ' + "9" * 10_000 + "}"),
    "a list": lambda path: path.write_text("[1]"),
    "an empty object": lambda path: path.write_text("{}"),
    "escapes": lambda path: other_json(path, lambda value: "\x1b[31m\u202e\ud800"),
    "other types": lambda path: other_json(path, lambda value: {"a": value} if isinstance(value, str) else str(value)),
    "nulls": lambda path: other_json(path, lambda value: None),
    "huge numbers": lambda path: other_json(path, lambda value: 10**18 if isinstance(value, int | float) else value),
    "numbers below nothing": lambda path: other_json(path, lambda v: -(10**18) if isinstance(v, int | float) else v),
    "paths out": lambda path: other_json(path, lambda v: "../" * 6 + "secret" if isinstance(v, str) else v),
    "absolute paths": lambda path: other_json(path, lambda v: str(outside(path)) if isinstance(v, str) else v),
    "another table": other_table,
    "huge columns": lambda path: altered_columns(path, huge),
    "columns of nothing": lambda path: altered_columns(path, lambda column: pa.nulls(len(column), column.type)),
    "an outer HDF5": outer_hdf5,
    "huge arrays": altered_hdf5,
    "another database": other_database,
}


def api_of(root: Path, out: Path) -> dict[str, dict[str, Callable[[], object]]]:
    """The functions that read each place, in this process."""
    scenes, episodes, run = root / "scenes", root / "episodes", root / "run"

    def load_scenes() -> None:
        for file in manitwin.find_scenes(scenes):
            manitwin.load_scene(file).placed_objects()

    def read_episodes() -> None:
        batches = batch_folders(episodes)
        assert all(list(read_attempts(folder / ATTEMPTS)) for folder in batches)
        list(stored_episodes(batches))

    return {
        "scenes": {
            "load_scene": load_scenes,
            "layout_totals": lambda: layout_totals(scenes),
            "make_layouts": lambda: make_layouts(root / "bricks", scenes, 2, LAYOUTS, executor="inline"),
            "export": lambda: [manitwin.export_scene(each, "mjcf", out) for each in manitwin.find_scenes(scenes)],
        },
        "episodes": {
            "stored_episodes": read_episodes,
            "collect": lambda: collect(episodes, ["lerobot", "maniskill"]),
            "read_lerobot": lambda: read_lerobot(episodes / "lerobot"),
            "make_episodes": lambda: make_episodes(root / "bricks", episodes, 2, EPISODES, executor="inline"),
        },
        "run": {"draw_episodes": lambda: render_batches(run, PicturesConfig(size_px=64), executor="inline")},
        "published": {"read_lerobot": lambda: read_lerobot(root / "published", decode_videos=True)},
    }


def commands_of(root: Path, out: Path) -> dict[str, list[list[str]]]:
    """The commands that read each place and start no processes."""
    scenes, episodes, run = (str(root / name) for name in ("scenes", "episodes", "run"))
    return {
        "scenes": [["status", scenes], ["check", scenes], ["export", scenes, "-o", str(out), "--to", "mjcf"]],
        "episodes": [["status", episodes], ["check", episodes], ["stats", episodes, "-o", str(out)]],
        "run": [["stats", run, "-o", str(out / "s")], ["publish", run, "-o", str(out / "p")]],
        "published": [["publish", run, "-o", str(root / "published")], ["stats", str(root / "published")]],
    }


def tamper(sound: Path, tmp_path: Path, place: str, file: str, damage: str) -> Path:
    """Copy the folders, alter one file of one of them, and lay a secret beside them."""
    root = Path(shutil.copytree(sound, tmp_path / "in", symlinks=True))
    for config in root.glob("*/config.json"):
        config.write_text(config.read_text().replace(str(sound), str(root)))
    (tmp_path / "secret").write_text(CANARY)
    (tmp_path / "in/secret").write_text(CANARY)
    DAMAGES[damage](root / place / file)
    return root


def everywhere(folder: Path) -> Iterator[Path]:
    for path in folder.rglob("*"):
        if path.is_file() and not path.is_symlink() and path.stat().st_size < 10_000_000:
            yield path


def assert_refused_in_one_line(line: str) -> None:
    assert len(line.splitlines()) == 1 and line.isprintable(), line
    assert CANARY not in line and "defect" not in line and "Traceback" not in line, line
    assert len(line) < 2000, line


def assert_all_readers_are_safe(
    sound: Path, tmp_path: Path, case: Case, monkeypatch: pytest.MonkeyPatch, capsys: Any, leave: frozenset[str] = SLOW
) -> None:
    place = case[0]
    root = tamper(sound, tmp_path, *case)
    out = tmp_path / "out"
    for name, reads in api_of(root, out)[place].items():
        if name in leave:
            continue
        try:
            with not_longer():
                report = reads()
            assert getattr(report, "exit_code", 0) in (0, 3, 4), name
        except ManiTwinError as error:
            assert_refused_in_one_line(str(error))
        shutil.rmtree(root)
        shutil.rmtree(tmp_path / "in", ignore_errors=True)
        root = tamper(sound, tmp_path, *case)
    for command in commands_of(root, out)[place]:
        monkeypatch.setattr(sys, "argv", ["manitwin", *command])
        with not_longer():
            status = main_module._run()
        said = capsys.readouterr()
        assert status in (0, 2, 3, 4), command
        told = [line for line in said.err.splitlines() if line.startswith(f"manitwin {command[0]}:")]
        assert len(told) == (1 if status == 2 else 0) or status == 4, (command, said.err)
        for line in (*told, *said.out.splitlines()):
            assert CANARY not in line and "\x1b" not in line and "Traceback" not in line, line
        if status == 2:
            assert_refused_in_one_line(told[0])
    assert (tmp_path / "secret").read_text() == (tmp_path / "in/secret").read_text() == CANARY
    assert {path.name for path in tmp_path.iterdir()} <= {"in", "out", "secret"}
    leaked = [path for path in (*everywhere(out), *everywhere(root)) if CANARY.encode() in path.read_bytes()]
    assert [path for path in leaked if path.name != "secret"] == [], "what lies outside of the folder was read"


def all_cases(sound: Path) -> list[Case]:
    """Each file of each place with each damage."""
    return [
        (place, str(path.relative_to(sound / place)), damage)
        for place in PLACES
        for path in sorted((sound / place).rglob("*"))
        if path.is_file() and not path.name.endswith((".lock", ".log", "-wal", "-shm"))
        for damage in DAMAGES
    ]


@pytest.mark.parametrize("part", range(SAMPLED))
def test_a_tampered_file_is_refused_in_one_line_or_not_needed(
    part: int, sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    case = random.Random(17).sample(all_cases(sound), SAMPLED)[part]
    assert_all_readers_are_safe(sound, tmp_path, case, monkeypatch, capsys)


@pytest.mark.slow
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("damage", DAMAGES)
def test_each_file_with_each_damage_is_refused_in_one_line_or_not_needed(
    place: str, damage: str, sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    wrong = []
    for number, case in enumerate(case for case in all_cases(sound) if case[0] == place and case[2] == damage):
        own = tmp_path / str(number)
        own.mkdir()
        try:
            assert_all_readers_are_safe(sound, own, case, monkeypatch, capsys, frozenset())
        except (Exception, Hangs) as error:
            wrong.append(f"{case}: {type(error).__name__}: {error}")
        shutil.rmtree(own)
    assert wrong == []


def test_episode_that_does_not_say_where_it_took_place_is_not_drawn(sound: Path, tmp_path: Path) -> None:
    run = Path(shutil.copytree(sound / "run", tmp_path / "run"))
    shutil.rmtree(run / "pictures")
    assert render_batches(run, PicturesConfig(size_px=64), executor="inline").exit_code == 4
    said = [cause.message for cause in read_causes(str(run / "pictures"))]
    assert said and all("facts.furniture: Field required" in line for line in said)
