"""The pages of recorded episodes as the server gives them, without a browser: list, episode, and what they refuse."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from asked_episodes import document, get, run_of, stored_ones

from drawn_episodes import attempt, write_batch, write_run
from manitwin.errors import EpisodesError, UsageError
from manitwin.web.episode_document import DOCUMENT
from manitwin.web.episode_folders import has_episodes
from manitwin.web.serve import application_for_place


def test_the_list_has_every_attempt_with_its_reason_and_leads_to_the_recorded_ones(run: Path) -> None:
    assert has_episodes(str(run)) and has_episodes(str(run / "maniskill" / "trajectory.h5"))
    status, page = get(run, "/")
    assert status == 200 and b"2 recorded episodes of 4 attempts" in page
    assert b"on_the_rim" in page and b"5 approach blocked" in page and b"move the can to the left" in page
    assert page.count(b'href="/episode/') == 2 and b'<a href="/episode/1">episode-00000001</a>' in page
    page = get(run, "/?outcome=no_plan")[1]
    assert b"approach blocked" in page and b"on_the_rim" not in page and b"/episode/" not in page
    assert b"/episode/1" in get(run, "/?outcome=kept&from=x")[1]
    assert b"on_the_rim" in get(run, "/?outcome=nonsense")[1]


def test_a_run_of_failures_alone_says_why(tmp_path: Path) -> None:
    place = write_run(tmp_path, [], (attempt(3, outcome="no_plan", plan_failures='{"no_path": 4}'),))
    status, page = get(place, "/")
    assert status == 200 and b"0 recorded episodes of 1 attempts" in page and b"4 no path" in page
    assert get(place, "/episode/0")[0] == 404


def test_the_page_says_how_it_ended_and_leads_to_its_neighbours_and_twins(run: Path) -> None:
    status, page = get(run, "/episode/0")
    assert status == 200 and b'rel="next" href="/episode/1"' in page and b'rel="prev"' not in page
    assert b"succeeded, and nothing was touched" in page and b"put the can down further left" in page
    assert f'data-document="/episode/0/{DOCUMENT}"'.encode() in page
    twin = document(run)["objects"][0]["twin_id"]
    assert f'href="/twin/{twin}"'.encode() in page and get(run, f"/twin/{twin}")[0] == 200


def test_a_run_that_goes_on_shows_its_batches_and_a_broken_one_as_one_line(tmp_path: Path) -> None:
    first, second, third = stored_ones(tmp_path, 3)
    write_batch(tmp_path, [first, second], name="aabatch")
    place = write_batch(tmp_path, [third], name="bbbatch")
    assert has_episodes(str(place)) and [document(place, number)["number"] for number in range(3)] == [0, 1, 2]
    (place / "batches" / "aa" / "aabatch" / "episodes.h5").write_bytes(b"no HDF5")
    page = get(place, "/")[1]
    assert b"2 recorded episodes" in page and page.count(b'class="error"') == 1
    assert get(place, "/episode/0")[0] == 422 and document(place, 1)["episode_id"] == third.attempt.episode_id


def test_one_file_is_shown_with_the_twins_that_are_named(tmp_path: Path) -> None:
    made = write_run(tmp_path)
    file = tmp_path / "alone" / "some.h5"
    file.parent.mkdir()
    shutil.copy(made / "maniskill" / "trajectory.h5", file)
    told = document(file)
    assert all(each["model"] is None for each in told["objects"]) and "--twins" in told["unreadable"][0]
    assert get(file, "/static/stage.js")[0] == 200 and get(file, f"/twin/{told['objects'][0]['twin_id']}")[0] == 404
    told = document(file, twins=str(tmp_path / "set"))
    assert told["unreadable"] == [] and all(each["model"] for each in told["objects"])
    with pytest.raises(UsageError, match="--twins is for episodes"):
        application_for_place(str(tmp_path / "scenes"), tmp_path / "cache", str(tmp_path / "set"))


def test_words_of_an_episode_are_never_read_as_html(tmp_path: Path) -> None:
    hostile = "<script>alert(1)</script>\u202e"
    place = run_of(tmp_path, instructions=(hostile,), category=hostile, skill=hostile, goal=hostile, failure=hostile)
    for path in ("/", "/episode/0"):
        page = get(place, path)[1]
        assert b"<script>alert" not in page and b"&lt;script&gt;" in page and "\u202e".encode() not in page
    assert "\u202e" not in json.dumps(document(place), ensure_ascii=False)


def test_nothing_beside_the_episodes_is_given(run: Path) -> None:
    for path in (
        "/episode/..%2fconfig.json",
        "/episode/2",
        "/episode/-1",
        "/episode/99999999999",
        f"/episode/x/{DOCUMENT}",
        "/episode/0/trajectory.h5",
        "/config.json",
        "/maniskill/trajectory.h5",
        "/robot/..%2fconfig/links.glb",
        "/robot/boxy.toml/links.glb",
        "/robot/panda/visual.glb",
    ):
        assert get(run, path)[0] == 404, path


def test_a_file_that_leads_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    place = write_run(tmp_path)
    file = place / "maniskill" / "trajectory.h5"
    shutil.move(file, tmp_path / "elsewhere.h5")
    file.symlink_to(tmp_path / "elsewhere.h5")
    with pytest.raises(EpisodesError, match="leads out of the folder"):
        application_for_place(str(place), tmp_path / "cache")


def test_what_holds_no_episode_is_told(tmp_path: Path) -> None:
    (tmp_path / "batches").mkdir()
    with pytest.raises(UsageError, match="no recorded episode there"):
        application_for_place(str(tmp_path), tmp_path / "cache")
    assert not has_episodes("s3://bucket/episodes") and not has_episodes(str(tmp_path / "nothing"))
    (tmp_path / "text.h5").write_text("text")
    with pytest.raises(EpisodesError, match="not a readable HDF5 file"):
        application_for_place(str(tmp_path / "text.h5"), tmp_path / "cache")
