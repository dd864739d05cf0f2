"""The strict reader: whatever of a sound set is spoilt, it says so."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from lerobot_sets import camera, episodes

from manitwin.episodes.lerobot.read import read_lerobot
from manitwin.episodes.lerobot.write import write_lerobot
from manitwin.errors import EpisodesError

DATA, EPISODES = "data/chunk-000/file-000.parquet", "meta/episodes/chunk-000/file-000.parquet"
VIDEO = "videos/observation.images.front/chunk-000/file-000.mp4"
Spoil = Callable[[Path], None]


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("set")
    given = episodes(4)
    write_lerobot(given, place / "lerobot", videos=[camera(place / "pictures", given)])
    return place / "lerobot"


def column(file: str, name: str, change: Callable[[list[Any]], Any]) -> Spoil:
    """Change a column's values."""

    def spoil(root: Path) -> None:
        table = pq.read_table(root / file)
        values = table[name].to_pylist()
        changed = change(values)
        field = table.schema.field(name)
        place = table.schema.get_field_index(name)
        fresh = pa.array(values if changed is None else changed, field.type)
        pq.write_table(table.set_column(place, field, fresh), root / file)

    return spoil


def table_of(file: str, change: Callable[[pa.Table], pa.Table]) -> Spoil:
    return lambda root: pq.write_table(change(pq.read_table(root / file)), root / file)


def json_of(file: str, change: Callable[[Any], Any]) -> Spoil:
    def spoil(root: Path) -> None:
        value = json.loads((root / file).read_text())
        change(value)
        (root / file).write_text(json.dumps(value))

    return spoil


def put(place: int, value: Any) -> Callable[[list[Any]], Any]:
    return lambda values: values.__setitem__(place, value)


def more(place: int, by: float) -> Callable[[list[Any]], Any]:
    return lambda values: values.__setitem__(place, values[place] + by)


def moved(name: str, target: str) -> Spoil:
    def spoil(root: Path) -> None:
        (root / target).parent.mkdir(parents=True, exist_ok=True)
        shutil.move(root / name, root / target)

    return spoil


def action(values: list[Any]) -> None:
    values[7] = [*values[7][:-1], 9.0]


SPOILT: dict[str, tuple[Spoil, str]] = {
    "info gone": (lambda root: (root / "meta/info.json").unlink(), "cannot be opened"),
    "info cut": (lambda root: (root / "meta/info.json").write_text("{"), "its JSON is broken"),
    "version": (json_of("meta/info.json", lambda i: i.update(codebase_version="v2.1")), "this reads v3.0"),
    "fps": (json_of("meta/info.json", lambda i: i.update(fps=20.0)), "fps is 20.0"),
    "splits": (json_of("meta/info.json", lambda i: i.update(splits={"train": "0:3"})), "splits"),
    "episodes counted": (json_of("meta/info.json", lambda i: i.update(total_episodes=5, splits={"train": "0:5"})), "there are 4"),
    "frames counted": (json_of("meta/info.json", lambda i: i.update(total_frames=7)), "total_frames is 7"),
    "no timestamp": (json_of("meta/info.json", lambda i: i["features"].pop("timestamp")), "feature timestamp"),
    "names": (json_of("meta/info.json", lambda i: i["features"]["action"]["names"].pop()), "7 names"),
    "shape": (json_of("meta/info.json", lambda i: i["features"]["action.tip_delta"].update(shape=[8], names=None)), "not (8,)"),
    "dtype": (json_of("meta/info.json", lambda i: i["features"]["phase"].update(dtype="int32")), "phase is of type"),
    "type": (
        table_of(DATA, lambda t: t.drop_columns("phase").append_column("phase", t["phase"].cast("float64"))),
        "phase is of type double",
    ),
    "column more": (json_of("meta/info.json", lambda i: i["features"].pop("phase")), "the column phase"),
    "slash": (json_of("meta/info.json", lambda i: i["features"].update({"a/b": i["features"]["phase"]})), "a/b"),
    "tasks gone": (lambda root: (root / "meta/tasks.parquet").unlink(), "cannot be opened"),
    "tasks index": (table_of("meta/tasks.parquet", lambda t: t.replace_schema_metadata(None)), "pandas index"),
    "tasks order": (column("meta/tasks.parquet", "task_index", lambda v: v[::-1]), "does not count from 0"),
    "tasks twice": (column("meta/tasks.parquet", "task", lambda v: v.__setitem__(1, v[0])), "empty or repeated"),
    "tasks counted": (json_of("meta/info.json", lambda i: i.update(total_tasks=9)), "count from 0 to 8"),
    "episode gap": (column(EPISODES, "episode_index", put(2, 3)), "stands where episode 2 should be"),
    "episode row gone": (table_of(EPISODES, lambda t: pa.concat_tables([t.slice(0, 1), t.slice(2)])), "episode 1 should be"),
    "from": (column(EPISODES, "dataset_from_index", more(2, 1)), "the one before ends at"),
    "length": (column(EPISODES, "length", more(1, -1)), "frames from"),
    "no task": (column(EPISODES, "tasks", put(0, [])), "which are not all in"),
    "strange task": (column(EPISODES, "tasks", put(0, ["dance"])), "which are not all in"),
    "episodes file": (moved(EPISODES, "meta/episodes/chunk-000/file-001.parquet"), "should be chunk 0, file 0"),
    "file of row": (column(EPISODES, "meta/episodes/file_index", put(0, 1)), "in another file"),
    "stats column": (table_of(EPISODES, lambda t: t.drop_columns(["stats/action/q50"])), "no column stats/action/q50"),
    "data gone": (lambda root: (root / DATA).unlink(), "do not match those named by the episodes"),
    "data elsewhere": (moved(DATA, "data/chunk-000/file-007.parquet"), "do not match those named by the episodes"),
    "data of row": (column(EPISODES, "data/file_index", put(3, 1)), "do not match those named by the episodes"),
    "data cut": (lambda root: (root / DATA).write_bytes((root / DATA).read_bytes()[:-100]), "no Parquet file"),
    "frame gone": (table_of(DATA, lambda t: t.slice(1)), "have another number"),
    "frame twice": (table_of(DATA, lambda t: pa.concat_tables([t.slice(0, 1), t.slice(0, 1), t.slice(2)])), "index does not"),
    "episode of frame": (column(DATA, "episode_index", put(3, 1)), "episode_index does not count"),
    "frame number": (column(DATA, "frame_index", more(3, 1)), "frame_index does not count"),
    "timestamp": (column(DATA, "timestamp", more(3, 0.0003)), "s off frame_index / fps"),
    "timestamp nan": (column(DATA, "timestamp", put(3, float("nan"))), "s off frame_index / fps"),
    "task of frame": (column(DATA, "task_index", put(3, 8)), "is none of its tasks"),
    "task beyond": (column(DATA, "task_index", put(3, 99)), "is none of its tasks"),
    "done early": (column(DATA, "next.done", put(3, True)), "next.done"),
    "value changed": (column(DATA, "action", action), "its statistics of action"),
    "value nan": (column(DATA, "observation.velocity", put(3, [float("nan")] * 7)), "observation.velocity is not finite"),
    "cell empty": (column(DATA, "phase", put(3, None)), "empty cells"),
    "stats gone": (lambda root: (root / "meta/stats.json").unlink(), "cannot be opened"),
    "stats of camera": (json_of("meta/stats.json", lambda s: s.pop("observation.images.front")), "observation.images"),
    "stats shape": (json_of("meta/stats.json", lambda s: s["action"]["mean"].pop()), "mean of action has the shape"),
    "stats wrong": (json_of("meta/stats.json", lambda s: s["action"].update(max=[9.0] * 8)), "not match those of all episodes"),
    "stats order": (json_of("meta/stats.json", lambda s: s["action"].update(q10=s["action"]["q90"])), "not in order"),
    "video gone": (lambda root: (root / VIDEO).unlink(), "the files of observation.images.front"),
    "video cut": (lambda root: (root / VIDEO).write_bytes((root / VIDEO).read_bytes()[:200]), "not a readable video"),
    "video swapped": (
        lambda root: shutil.copy(root / "data/chunk-000/file-000.parquet", root / VIDEO),
        "not a readable video",
    ),
    "video size": (
        json_of("meta/info.json", lambda i: i["features"]["observation.images.front"].update(shape=[48, 65, 3])),
        "info.json says",
    ),
    "video late": (column(EPISODES, "videos/observation.images.front/from_timestamp", more(1, 0.02)), "are not"),
    "video long": (column(EPISODES, "videos/observation.images.front/to_timestamp", more(1, 1.0)), "are not"),
}  # fmt: skip


def test_a_sound_set_is_read(sound: Path) -> None:
    found = read_lerobot(sound, decode_videos=True)
    assert len(found.episodes) == 4
    assert found.frames(2)["action"].shape == (found.episodes[2]["length"], 8)


@pytest.mark.parametrize("name", SPOILT)
def test_spoilt_sets_are_refused_with_the_file_and_the_cause(sound: Path, tmp_path: Path, name: str) -> None:
    spoil, said = SPOILT[name]
    root = tmp_path / "set"
    shutil.copytree(sound, root)
    spoil(root)
    with pytest.raises(EpisodesError) as raised:
        read_lerobot(root)
    line = str(raised.value)
    assert said in line and str(root) in line and "again" in line and "\n" not in line


def test_episodes_that_share_frames_of_a_video_are_refused(sound: Path, tmp_path: Path) -> None:
    root = tmp_path / "set"
    shutil.copytree(sound, root)
    table = pq.read_table(root / EPISODES)
    for end in ("from", "to"):
        name = f"videos/observation.images.front/{end}_timestamp"
        values = np.array(table[name].to_pylist())
        values[1] -= 0.5
        table = table.set_column(table.schema.get_field_index(name), name, pa.array(values))
    pq.write_table(table, root / EPISODES)
    with pytest.raises(EpisodesError, match="episodes 0 and 1 share frames"):
        read_lerobot(root)


def test_a_folder_without_anything_is_no_set(tmp_path: Path) -> None:
    with pytest.raises(EpisodesError, match=r"info\.json: cannot be opened"):
        read_lerobot(tmp_path)
