"""Episodes that cannot be published, or not all: it is said why, nothing is left half-written, and it can be done again."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
import typer
from publishable_run import BOWL, LICENCES, OBJECTS, write_run
from typer.testing import CliRunner

from manitwin.cli.commands.publish import publish
from manitwin.dataset.publish.publication import EPISODES, Publication
from manitwin.episodes.batch import BATCH_RECORD
from manitwin.episodes.episode_pictures import PICTURES_RECORD, batch_name
from manitwin.episodes.publication.publish import PublishedEpisodes, publish_episodes
from manitwin.errors import EpisodesError, UsageError
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.store import RECORD, digests_below, write_twin_record

app = typer.Typer()
app.command()(publish)


def test_episodes_of_a_rehearsals_twin_stay_unless_they_are_asked_for(run: Path, twins: Path, tmp_path: Path) -> None:
    place = tmp_path / "twins"
    shutil.copytree(twins, place)
    folder = place / twin_name(BOWL)
    record = json.loads((folder / RECORD).read_bytes())
    record["provenance"]["stages"]["points"]["rehearsal"] = True
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    arguments = [str(run), "-o", str(tmp_path / "out"), "--twins", str(place), "--license-allow"]
    done = CliRunner().invoke(app, [*arguments, ",".join(LICENCES.values())])
    assert done.exit_code == 0, done.output
    with_the_bowl = sum(BOWL in ids for ids in OBJECTS)
    assert (
        f"{6 - with_the_bowl} episodes of" in done.output
        and f"{with_the_bowl} left out: made with a rehearsal server" in done.output
    )
    assert BOWL not in "".join(path.read_text() for path in (tmp_path / "out").glob("*.md"))
    with pytest.raises(
        UsageError, match=r"no kept episode can be published: 3 were made with a rehearsal server.*--with-rehearsals"
    ):
        publish_episodes(run, tmp_path / "none", twins=place, license_allow=["CC0-1.0", "CC-BY-4.0"])
    asked = publish_episodes(
        run, tmp_path / "all", twins=place, license_allow=["CC0-1.0", "CC-BY-4.0"], with_rehearsals=True
    )
    assert (asked.episodes, asked.rehearsals) == (3, 0)


def test_what_cannot_be_published_leaves_nothing(run: Path, twins: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with pytest.raises(UsageError, match=r"no kept episode can be published; .*CC-BY-4.0 \+ CC-BY-NC-4.0 \(2\)"):
        publish_episodes(run, out, license_allow=["MIT"])
    with pytest.raises(UsageError, match=r"this folder does not exist.*--twins"):
        publish_episodes(run, out, twins=tmp_path / "elsewhere")
    half = tmp_path / "half"
    write_run(half, twins, drawn=True)
    (half / "pictures" / batch_name("11batch") / PICTURES_RECORD).unlink()
    with pytest.raises(EpisodesError, match=r"pictures.json: cannot be opened.*manitwin render"):
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
    with pytest.raises(UsageError, match="not a publication of episodes"):
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
            assert [path.name for path in out.iterdir() if path.name.startswith(".")] == [".publish"]
            raise OSError(28, "No space left on device")
        real(self, path, name)

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
    for more, why in (
        (["--twins-per-shard", "2"], "not written as shards"),
        (["--shard-size-mb", "5"], "not written as shards"),
    ):
        with pytest.raises(UsageError, match=why):
            CliRunner().invoke(app, [*arguments, *more], catch_exceptions=False)
    with pytest.raises(UsageError, match="contains no episodes"):
        CliRunner().invoke(app, [str(twins), "-o", str(tmp_path / "x"), "--twins", str(twins)], catch_exceptions=False)


def test_what_a_killed_publication_left_goes_and_is_below_its_own_folder(run: Path, tmp_path: Path) -> None:
    out = tmp_path / "cups"
    publication = Publication(DatasetRoot(out), EPISODES)
    with publication.scratch() as scratch:
        (scratch / "film.mp4").write_bytes(b"film")
        assert scratch.parent == out / ".publish"
        shutil.copytree(scratch, scratch.with_name("scratch-killed"))
        assert [path.name for path in tmp_path.iterdir()] == ["cups"]
    assert (out / ".publish" / "scratch-killed" / "film.mp4").is_file()
    with publication.scratch() as again:
        publication.begin()
        assert again.is_dir() and [path.name for path in (out / ".publish").glob("scratch-*")] == [again.name]
    publish_episodes(run, out, license_allow=["CC-BY-4.0", "CC0-1.0"])
    assert not [path.name for path in out.iterdir() if path.name.startswith(".")]


def test_a_batch_without_its_record_says_so(run: Path, tmp_path: Path) -> None:
    half = tmp_path / "half"
    shutil.copytree(run, half)
    (half / batch_name("11batch") / BATCH_RECORD).write_text("{}")
    with pytest.raises(EpisodesError, match=r"batch\.json: config_sha256: Field required; run manitwin traj") as raised:
        publish_episodes(half, tmp_path / "out", license_allow=["CC-BY-4.0", "CC0-1.0"])
    assert "\n" not in str(raised.value) and not (tmp_path / "out").exists()


@pytest.mark.parametrize("frame", [10**30, 10**6, -1])
def test_record_of_pictures_with_frames_that_no_film_has_is_refused(
    run: Path, twins: Path, tmp_path: Path, frame: int
) -> None:
    place = Path(shutil.copytree(run, tmp_path / "run"))
    for record in place.rglob(PICTURES_RECORD):
        said = json.loads(record.read_bytes())
        said["first_frames"] = dict.fromkeys(list(said["first_frames"])[:1], frame) | dict(
            list(said["first_frames"].items())[1:]
        )
        record.write_text(json.dumps(said))
    with pytest.raises(EpisodesError, match="frames, but another number was recorded"):
        publish_episodes(place, tmp_path / "out", twins=twins, license_allow=["CC0-1.0"])
