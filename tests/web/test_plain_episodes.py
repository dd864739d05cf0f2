"""The pages of recorded episodes as plain files."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from manitwin.errors import UsageError
from manitwin.web.static_pages import write_static_pages


def test_plain_files_have_list_episodes_robot_and_twins_and_are_the_same_again(run: Path, tmp_path: Path) -> None:
    done = write_static_pages(str(run), tmp_path / "pages")
    files = {path.relative_to(tmp_path / "pages").as_posix(): path for path in (tmp_path / "pages").rglob("*.*")}
    assert (done.episodes, done.scenes, done.left_out) == (2, 0, {}) and done.twins >= 1
    assert done.size_bytes == sum(path.stat().st_size for path in files.values() if path.is_file())
    text = {name: path.read_text() for name, path in files.items() if path.suffix in (".html", ".js")}
    assert text["index.html"].count('href="episodes/') == 2 and "2 recorded episodes" in text["index.html"]
    page = text["episodes/1/index.html"]
    assert 'data-document="../../episodes/1/episode_view.json"' in page and 'href="../../episodes/0/index.html"' in page
    for named in re.findall(r'(?:src|href)="([^"#:]+)"', page):
        assert (tmp_path / "pages" / "episodes" / "1" / named).is_file(), named
    told = json.loads(text["episodes/1/episode_view.js"].split("=", 2)[2].rstrip(";\n"))
    [robot] = told["robots"]
    for model in (robot["model"], *(each["model"] for each in told["objects"])):
        script = text[f"{model.removeprefix('../../')}.js"]
        assert f'["{model.removeprefix("../../")}"]="' in script
    assert str(run) not in "".join(text.values()), "no folder of this machine"
    write_static_pages(str(run), tmp_path / "again")
    for name, path in files.items():
        assert path.is_dir() or (tmp_path / "again" / name).read_bytes() == path.read_bytes(), name


def test_plain_files_leave_out_an_episode_that_cannot_be_shown_whole(run: Path, tmp_path: Path) -> None:
    shutil.copytree(run, tmp_path / "run")
    (tmp_path / "empty").mkdir()
    done = write_static_pages(str(tmp_path / "run"), tmp_path / "none", twins=str(tmp_path / "empty"))
    assert done.episodes == done.twins == 0 and set(done.left_out) == {"episode 0", "episode 1"}
    assert "0 recorded episodes" in (tmp_path / "none" / "index.html").read_text()
    drawn = write_static_pages(str(run), tmp_path / "one", sample=1, seed=3)
    assert drawn.episodes == 1 and len(list((tmp_path / "one" / "episodes").iterdir())) == 1
    with pytest.raises(UsageError, match="--where"):
        write_static_pages(str(run), tmp_path / "where", where="mass_kg > 1")
    assert not (tmp_path / "where").exists()
