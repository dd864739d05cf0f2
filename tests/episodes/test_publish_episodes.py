"""Episodes as a repository for the hub: what goes out, and that nothing does of what may not."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from lerobot_sets import color_rgb, picture
from publishable_run import (
    ALLOWED,
    BOWL,
    LICENCES,
    MUG,
    PINHOLE,
    PLAIN,
    TOY,
    stored,
    write_record,
    write_run,
    write_twins,
)
from test_episode_video import decoded

from manitwin.episodes.attempts import ATTEMPTS, read_attempts
from manitwin.episodes.episode_pictures import batch_name
from manitwin.episodes.lerobot.read import read_lerobot
from manitwin.episodes.publication.publish import PublishedEpisodes, publish_episodes
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.store import RECORD, digests_below, write_twin_record


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


def test_what_was_drawn_at_a_lower_rate_goes_out_at_it(run: Path, tmp_path: Path) -> None:
    slow = tmp_path / "run"
    write_run(slow, Path(json.loads((run / "config.json").read_text())["dataset"]), drawn=True, rate_hz=5)
    publish_episodes(slow, tmp_path / "cups", license_allow=["cc-by-4.0", "CC0-1.0"])
    found = read_lerobot(tmp_path / "cups", decode_videos=True)
    assert found.info["fps"] == 5
    assert [row["length"] for row in found.episodes] == [stored(n).recording.steps // 4 for n in ALLOWED]


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
    assert found.info["features"]["observation.images.front"]["info"].items() >= PINHOLE.items()
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


def test_merged_attempts_of_the_run_are_left_as_they_were(run: Path) -> None:
    assert len(list(read_attempts(run / ATTEMPTS))) == 9


def revisions_told(out: Path) -> dict[str, list[str]]:
    return {row["twin_id"]: row["revisions"] for row in pq.read_table(out / "twins.parquet").to_pylist()}


def test_revisions_are_those_that_the_episodes_were_made_with(tmp_path: Path) -> None:
    twins, run = tmp_path / "cups", tmp_path / "run"
    write_twins(twins)
    write_run(run, twins, drawn=False)
    before = {each: TwinSource(twins).twin(each).record.revision for each in (MUG, BOWL)}
    amend(twins, MUG)
    amend(twins, BOWL)
    after = {each: TwinSource(twins).twin(each).record.revision for each in (MUG, BOWL)}
    publish_episodes(run, tmp_path / "amended", license_allow=["CC-BY-4.0", "CC0-1.0"])
    assert revisions_told(tmp_path / "amended") == {each: [before[each]] for each in before}

    write_record(run / batch_name("22batch"), TwinSource(twins), {BOWL, PLAIN})  # a batch that was made after that
    publish_episodes(run, tmp_path / "grown", license_allow=["CC-BY-4.0", "CC0-1.0"])
    told = revisions_told(tmp_path / "grown")
    assert told == {MUG: [before[MUG]], BOWL: sorted([before[BOWL], after[BOWL]])}


def amend(twins: Path, twin_id: str) -> None:
    """Change a twin as retired grasps do: same id, another revision."""
    folder = twins / twin_name(twin_id)
    record = json.loads((folder / RECORD).read_bytes())
    record["language"]["caption"] += " Amended."
    del record["revision"], record["files"]
    write_twin_record(folder, record)
