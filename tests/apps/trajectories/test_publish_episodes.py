"""Episodes as a repository for the hub: what goes out, and that nothing does of what may not."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import typer
import yaml
from lerobot_sets import HEIGHT_PX, WIDTH_PX, color_rgb, picture
from synthetic_episodes import attempt, episode
from test_episode_video import decoded
from typer.testing import CliRunner

from manitwin.app_config import TrajectoriesConfig
from manitwin.apps.trajectories.attempts_table import ATTEMPTS, merge_attempts, read_attempts, write_attempts
from manitwin.apps.trajectories.batch import BATCH_RECORD
from manitwin.apps.trajectories.episodes_stage import EPISODES
from manitwin.apps.trajectories.hdf5_file import write_episodes
from manitwin.apps.trajectories.lerobot.read import read_lerobot
from manitwin.apps.trajectories.pictures_recipe import PICTURES_RECORD, PicturesRecord, batch_name
from manitwin.apps.trajectories.publication.publish import PublishedEpisodes, publish_episodes
from manitwin.apps.trajectories.stored_episode import RecordedObject, StoredEpisode
from manitwin.apps.trajectories.video import EpisodesVideo
from manitwin.commands.publish import publish
from manitwin.dataset_root import twin_name
from manitwin.errors import EpisodesError, UsageError
from manitwin.store import RECORD, digests_below, seal
from twin_folders import twin_id, write_accepted

app = typer.Typer()
app.command()(publish)

LICENCES = {0: "CC-BY-4.0", 1: "CC0-1.0", 2: "CC-BY-NC-4.0", 3: "unknown"}
MUG, BOWL, TOY, PLAIN = (twin_id(number) for number in LICENCES)
OBJECTS = ((MUG, BOWL), (MUG, TOY), (BOWL, MUG), (TOY, MUG), (BOWL, PLAIN), (BOWL,))
"""The twins in each kept episode, the one that is moved first; batches are of two."""
ALLOWED = (0, 2, 5)


def stored(number: int) -> StoredEpisode:
    """The synthetic episode of a number with these twins as its objects; its target is the first of them."""
    ids = OBJECTS[number]
    made = episode(number, things=len(ids))
    order = sorted(range(len(ids)), key=lambda place: place != made.recording.target)
    objects = {place: RecordedObject(f"object_{place:02d}", ids[rank]) for rank, place in enumerate(order)}
    category = "toy" if ids[0] == TOY else "cup"
    told = replace(made.attempt, twin_id=ids[0], category=category, instructions=(f"move the {category} {number}",))
    return replace(made, attempt=told, objects=tuple(objects[place] for place in range(len(ids))))


def write_twins(root: Path) -> None:
    for number, licence in LICENCES.items():
        folder = root / twin_name(write_accepted(root, number))
        record = json.loads((folder / RECORD).read_bytes())
        record["source"] |= {"license": licence, "attribution": "Ada & Bo" if number == 0 else None}
        del record["revision"], record["files"]
        seal(folder, record)


def write_run(root: Path, twins: Path, *, drawn: bool) -> None:
    """What a finished run leaves: six kept episodes in three batches, and three failed attempts."""
    config = TrajectoriesConfig(seed=7).model_dump(mode="json")
    root.mkdir(parents=True)
    said = {"kind": "trajectories", "dataset": str(twins), "scenes": None, **config}
    (root / "config.json").write_text(json.dumps(said))
    failed = [
        replace(attempt(6 + n, outcome="dropped"), twin_id=each, category="cup", instructions=(f"drop {n}",))
        for n, each in enumerate((MUG, TOY, PLAIN))
    ]
    files = []
    for number in range(3):
        folder = root / batch_name(f"{number}{number}batch")
        folder.mkdir(parents=True)
        both = [stored(2 * number), stored(2 * number + 1)]
        write_episodes(folder / EPISODES, both)
        write_attempts(folder / ATTEMPTS, [*(each.attempt for each in both), failed[number]])
        (folder / BATCH_RECORD).write_text("{}")
        files.append(folder / ATTEMPTS)
        if drawn:
            draw(root / "pictures" / batch_name(folder.name), both)
    merge_attempts(files, root / ATTEMPTS)
    if drawn:
        (root / "pictures" / "config.json").write_text(json.dumps({"kind": "pictures", "cameras": ["front"]}))


def draw(folder: Path, both: list[StoredEpisode]) -> None:
    first_frames = {}
    with EpisodesVideo(folder / "front.mp4", width_px=WIDTH_PX, height_px=HEIGHT_PX) as film:
        for each in both:
            number, steps = each.facts["number"], each.recording.steps
            span = film.add(picture(number, t, steps) for t in range(steps))
            first_frames[each.attempt.episode_id] = span.first_frame
    record = PicturesRecord(batch_id=folder.name, config_sha256="", revision="", first_frames=first_frames, files={})
    (folder / PICTURES_RECORD).write_text(record.model_dump_json())


@pytest.fixture(scope="module")
def twins(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("private") / "cups"
    write_twins(root)
    return root


@pytest.fixture(scope="module")
def run(twins: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("runs") / "episodes"
    write_run(root, twins, drawn=True)
    return root


@pytest.fixture(scope="module")
def published(run: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, PublishedEpisodes]:
    out = tmp_path_factory.mktemp("out") / "cups"
    return out, publish_episodes(run, out, license_allow=["cc-by-4.0", "CC0-1.0"])


def files_below(root: Path) -> Iterator[Path]:
    return (path for path in sorted(root.rglob("*")) if path.is_file())


def test_strict_reader_reads_what_went_out(published: tuple[Path, PublishedEpisodes]) -> None:
    out, told = published
    found = read_lerobot(out, decode_videos=True)
    assert [row["episode_id"] for row in found.episodes] == [stored(n).attempt.episode_id for n in ALLOWED]
    assert (told.episodes, told.frames) == (3, sum(stored(n).recording.steps for n in ALLOWED))
    assert told.left_out == {"CC-BY-NC-4.0": 2, "unknown": 1}
    for number, original in enumerate(ALLOWED):
        frames = found.frames(number)
        wanted = stored(original).recording.action_joint_positions_rad
        assert np.array_equal(frames["action"][:, :-1], wanted)


def test_episodes_of_other_licences_are_in_no_file(published: tuple[Path, PublishedEpisodes]) -> None:
    out, _ = published
    gone = [stored(n) for n in range(6) if n not in ALLOWED]
    for path in files_below(out):
        content = path.read_bytes()
        if path.suffix == ".parquet":
            content = json.dumps(pq.read_table(path).to_pylist(), default=str).encode()
        for each in gone:
            assert each.attempt.episode_id.encode() not in content, path
            assert each.attempt.instructions[0].encode() not in content, path
        assert TOY.encode() not in content and PLAIN.encode() not in content, path
    frames = np.concatenate([read_lerobot(out).frames(n)["observation.state"] for n in range(3)])
    stats = json.loads((out / "meta/stats.json").read_text())["observation.state"]
    np.testing.assert_allclose(stats["mean"], frames.mean(0), atol=1e-5)
    np.testing.assert_allclose(stats["max"], frames.max(0), atol=1e-6)


def test_films_are_cut_to_what_goes_out_and_show_every_picture_of_it(published: tuple[Path, PublishedEpisodes]) -> None:
    out, _ = published
    colors = {n: color_rgb(n) for n in range(6)}
    shown: list[int] = []
    for film in sorted((out / "videos").rglob("*.mp4")):
        for frame in decoded(film):
            edge = frame[:, -1].mean(axis=0)
            shown.append(min(colors, key=lambda n: float(np.abs(edge - colors[n]).max())))
    wanted = [n for n in ALLOWED for _ in range(stored(n).recording.steps)]
    assert shown == wanted
    found = read_lerobot(out)
    for row, number in zip(found.episodes, ALLOWED, strict=True):
        mean = row_statistics(out, row["episode_index"])
        steps = stored(number).recording.steps
        expected = np.mean([picture(number, t, steps).mean((0, 1)) for t in range(steps)], axis=0) / 255
        np.testing.assert_allclose(mean, expected, atol=0.03)


def row_statistics(out: Path, index: int) -> np.ndarray:
    table = pq.read_table(next((out / "meta/episodes").rglob("*.parquet")))
    return np.array(table["stats/observation.images.front/mean"][index].as_py(), float).reshape(3)


def test_attempts_and_twins_go_out_numbered_as_the_episodes(published: tuple[Path, PublishedEpisodes]) -> None:
    out, _ = published
    rows = pq.read_table(out / "attempts.parquet").to_pylist()
    kept = [row for row in rows if row["outcome"] == "kept"]
    assert [row["episode_index"] for row in kept] == [0, 1, 2]
    assert [row["twin_id"] for row in rows if row["outcome"] == "dropped"] == [MUG]
    there = {row["twin_id"]: row for row in pq.read_table(out / "twins.parquet").to_pylist()}
    assert {each: row["episodes"] for each, row in there.items()} == {MUG: [0, 1], BOWL: [0, 1, 2]}
    assert there[MUG]["attribution"] == "Ada & Bo" and there[BOWL]["license"] == "CC0-1.0"
    assert set(there) == {MUG, BOWL}
    licences = (out / "LICENSES.md").read_text()
    assert f"Ada &amp; Bo: {MUG}" in licences and BOWL in licences


def test_card_says_what_is_there_and_its_front_matter_is_yaml(published: tuple[Path, PublishedEpisodes]) -> None:
    out, _ = published
    _, front, text = (out / "README.md").read_text().split("---\n", 2)
    said = yaml.safe_load(front)
    assert said["pretty_name"] == "cups"
    assert said["license"] == "other" and said["license_link"] == "LICENSES.md"
    assert said["task_categories"] == ["robotics"] and "LeRobot" in said["tags"]
    for config in said["configs"]:
        (files,) = config["data_files"]
        assert list(out.glob(files["path"])), config
    assert "| episodes | 3 |" in text and "front (64 x 48, vp9)" in text and "`observation.tip_pose`" in text
    assert "CC-BY-NC-4.0 2, unknown 1" in text
    # every attempt at a mug or bowl: 5 kept, of which two stay here for what stood around, and one dropped
    assert "| all | 6 | 6 | 5 | 83.3% | 5 |" in text
    assert "Every object that was tried succeeded at least once." in text
    assert "data set cups" in text and "private" not in text


def test_objects_without_a_success_are_named(run: Path, tmp_path: Path) -> None:
    publish_episodes(run, tmp_path / "out", license_allow=LICENCES.values())
    assert f"which no episode moves (1): cup `{PLAIN}`" in (tmp_path / "out" / "README.md").read_text()
    assert len(read_lerobot(tmp_path / "out", decode_videos=True).episodes) == 6
    film = next((run / "pictures").rglob("*.mp4"))
    assert film.read_bytes() in [path.read_bytes() for path in (tmp_path / "out").rglob("*.mp4")]  # whole, as it was


def test_same_episodes_give_the_same_bytes_and_an_older_publication_is_replaced(
    run: Path, published: tuple[Path, PublishedEpisodes], tmp_path: Path
) -> None:
    out = tmp_path / "cups"
    publish_episodes(run, out, license_allow=LICENCES.values())
    (out / ".gitattributes").write_text("*.mp4 filter=lfs\n")
    publish_episodes(run, out, license_allow=["CC-BY-4.0", "CC0-1.0"])
    (out / ".gitattributes").unlink()
    assert digests_below(out) == digests_below(published[0])
    for line in (out / "SHA256SUMS").read_text().splitlines():
        digest, name = line.split("  ")
        assert hashlib.sha256((out / name).read_bytes()).hexdigest() == digest
    assert {path.name for path in out.iterdir() if path.is_dir()} == {"meta", "data", "videos"}


def test_episodes_of_a_rehearsals_twin_stay_unless_they_are_asked_for(run: Path, twins: Path, tmp_path: Path) -> None:
    place = tmp_path / "twins"
    shutil.copytree(twins, place)
    folder = place / twin_name(BOWL)
    record = json.loads((folder / RECORD).read_bytes())
    record["provenance"]["stages"]["points"]["rehearsal"] = True
    del record["revision"], record["files"]
    seal(folder, record)
    arguments = [str(run), "-o", str(tmp_path / "out"), "--twins", str(place), "--license-allow"]
    done = CliRunner().invoke(app, [*arguments, ",".join(LICENCES.values())])
    assert done.exit_code == 0, done.output
    with_the_bowl = sum(BOWL in ids for ids in OBJECTS)
    assert f"{6 - with_the_bowl} episodes of" in done.output and f"{with_the_bowl} rehearsals left out" in done.output
    assert BOWL not in "".join(path.read_text() for path in (tmp_path / "out").glob("*.md"))
    with pytest.raises(UsageError, match=r"3 show twins of a rehearsal.*--with-rehearsals"):
        publish_episodes(run, tmp_path / "none", twins=place, license_allow=["CC0-1.0", "CC-BY-4.0"])
    asked = publish_episodes(
        run, tmp_path / "all", twins=place, license_allow=["CC0-1.0", "CC-BY-4.0"], with_rehearsals=True
    )
    assert (asked.episodes, asked.rehearsals) == (3, 0)


def test_what_cannot_be_published_leaves_nothing(run: Path, twins: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with pytest.raises(UsageError, match=r"no episode may go out; .*CC-BY-4.0 \+ CC-BY-NC-4.0 \(2\)"):
        publish_episodes(run, out, license_allow=["MIT"])
    with pytest.raises(UsageError, match=r"no such folder.*--twins"):
        publish_episodes(run, out, twins=tmp_path / "elsewhere")
    half = tmp_path / "half"
    write_run(half, twins, drawn=True)
    (half / "pictures" / batch_name("11batch") / PICTURES_RECORD).unlink()
    with pytest.raises(EpisodesError, match=r"no record of pictures.*manitwin render"):
        publish_episodes(half, out, license_allow=LICENCES.values())
    assert not out.exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["half"]


def test_words_that_name_somebodys_folder_stop_it(twins: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    write_run(run, twins, drawn=False)
    with pytest.raises(EpisodesError, match=r"LICENSES\.md: names the folder '/home/ada/'"):
        publish_episodes(run, tmp_path / "out", license_allow=["CC0-1.0", "CC-BY-4.0"], name="cups of /home/ada/cups")
    assert not (tmp_path / "out").exists()


def test_folder_with_anything_else_is_refused(run: Path, tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("")
    with pytest.raises(UsageError, match="no publication of episodes"):
        publish_episodes(run, tmp_path, license_allow=["CC0-1.0", "CC-BY-4.0"])
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_interrupted_while_it_is_put_into_its_place_is_done_again(
    run: Path, published: tuple[Path, PublishedEpisodes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "cups"
    calls = []

    def fails(self: object, path: Path, name: str) -> None:
        calls.append(name)
        if len(calls) == 3:
            raise OSError(28, "No space left on device")
        real(self, path, name)

    from manitwin.publish.publication import Publication

    real = Publication.put
    with monkeypatch.context() as patch:
        patch.setattr(Publication, "put", fails)
        with pytest.raises(UsageError, match=r"not finished .*No space left.*publish again"):
            publish_episodes(run, out, license_allow=["CC-BY-4.0", "CC0-1.0"])
    assert not (out / "SHA256SUMS").exists()
    publish_episodes(run, out, license_allow=["CC-BY-4.0", "CC0-1.0"])
    assert digests_below(out) == digests_below(published[0])
    assert not (out / ".publish").exists()


def test_command_tells_episodes_from_twins(run: Path, twins: Path, tmp_path: Path) -> None:
    arguments = [str(run), "-o", str(tmp_path / "out"), "--license-allow", "CC-BY-4.0,CC0-1.0", "--twins", str(twins)]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    assert "3 episodes of 2 twins" in done.output
    assert "3 left out by licence: CC-BY-NC-4.0 2, unknown 1" in done.output
    for more, why in ((["--twins-per-shard", "2"], "no shards"), (["--shard-size-mb", "5"], "no shards")):
        with pytest.raises(UsageError, match=why):
            CliRunner().invoke(app, [*arguments, *more], catch_exceptions=False)
    with pytest.raises(UsageError, match="holds no episodes"):
        CliRunner().invoke(app, [str(twins), "-o", str(tmp_path / "x"), "--twins", str(twins)], catch_exceptions=False)


def test_merged_attempts_of_the_run_are_left_as_they_were(run: Path) -> None:
    assert len(list(read_attempts(run / ATTEMPTS))) == 9
