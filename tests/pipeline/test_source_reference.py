import json
from pathlib import Path

import pytest

import manitwin
from manitwin.config import BuildConfig, SourceConfig
from manitwin.pipeline.recipe import config_sha256
from manitwin.twin.store import read_record

BY_REFERENCE = BuildConfig(source=SourceConfig(keep="reference"))


def built(place: Path, config: BuildConfig) -> Path:
    place.mkdir()
    (place / "broken.ply").write_bytes(b"ply\nbroken\n")
    (result,) = manitwin.build(place / "broken.ply", place / "twins", config=config, executor="inline").results
    assert result.folder is not None
    return result.folder


def test_folder_says_what_the_input_was_and_only_run_json_where_it_lay(tmp_path: Path) -> None:
    folder = built(tmp_path / "a", BY_REFERENCE)
    assert not list(folder.glob("*.ply"))
    assert "broken.ply: 11 bytes, sha256 " in (folder / "source.txt").read_text()
    assert json.loads((folder / "run.json").read_text())["host"]["source"] == [str(tmp_path / "a" / "broken.ply")]
    assert not [
        path for path in folder.iterdir() if path.name != "run.json" and str(tmp_path).encode() in path.read_bytes()
    ]


def test_same_input_in_another_place_gives_the_same_revision(tmp_path: Path) -> None:
    first, second = (read_record(built(tmp_path / name, BY_REFERENCE)) for name in "ab")
    assert (first.twin_id, first.revision) == (second.twin_id, second.revision)
    assert first.source.file == "source.txt"


@pytest.mark.parametrize("config", [BuildConfig(), BuildConfig(source=SourceConfig(keep="copy"))])
def test_a_copy_is_what_was_before_there_was_a_choice(tmp_path: Path, config: BuildConfig) -> None:
    folder = built(tmp_path / "a", config)
    assert (folder / "source.ply").read_bytes() == b"ply\nbroken\n"
    assert "source" not in json.loads((folder / "run.json").read_text())["host"]
    assert config_sha256(config) == config_sha256(BuildConfig()) != config_sha256(BY_REFERENCE)
