"""The statistics of a folder of episodes against counts of our own, as text and as a page."""

from __future__ import annotations

import json
import struct
from collections import Counter
from dataclasses import replace
from pathlib import Path

import duckdb
import numpy as np
import pytest
from synthetic_episodes import attempt, episode, robot

from manitwin.episodes.attempts import ATTEMPTS, OUTCOMES, Attempt, merge_attempts, write_attempts
from manitwin.episodes.hdf5_file import write_episodes
from manitwin.episodes.statistics.queries import PRELUDE
from manitwin.episodes.statistics.report import EpisodeReport, episode_statistics
from manitwin.errors import EpisodesError
from manitwin.twin.store import digests_below


def attempts(count: int = 220) -> list[Attempt]:
    """All outcomes; one object never succeeds; two robots; lengths all different."""
    rng = np.random.default_rng(0)
    made = []
    for i in range(count):
        outcome = OUTCOMES[int(rng.integers(len(OUTCOMES)))] if rng.random() < 0.6 else "kept"
        one = attempt(i, outcome=outcome, robot_name="ur5" if i % 4 == 0 else "panda", transferred=i % 4 == 0)
        if one.twin_id == "hammer_05":
            one = attempt(i, outcome="dropped" if i % 12 == 5 else "no_plan", robot_name=one.robot)
        if one.length_s is not None:
            one = replace(one, length_s=round(5 + 5 * float(rng.random()), 3))
        made.append(one)
    return made


def folder(place: Path, rows: list[Attempt]) -> Path:
    for number in range(2):
        batch = place / "batches" / f"0{number}" / "batch"
        write_attempts(batch / ATTEMPTS, rows[number::2])
        of = robot(6, "ur5") if number else robot()
        write_episodes(batch / "episodes.h5", [episode(number * 10 + i, of=of, steps=40) for i in range(4)])
    merge_attempts(sorted(place.glob(f"batches/*/*/{ATTEMPTS}")), place / ATTEMPTS)
    return place


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return folder(tmp_path_factory.mktemp("episodes") / "run", attempts())


@pytest.fixture(scope="module")
def report(place: Path) -> EpisodeReport:
    return episode_statistics(place)


def test_outcomes_are_sorted_as_attempts_sort_themselves() -> None:
    connection = duckdb.connect()
    connection.execute(PRELUDE)
    for outcome in OUTCOMES:
        one = attempt(0, outcome=outcome)
        said = connection.execute("SELECT executed($1), succeeded($1), kept($1)", [outcome]).fetchone()
        assert said == (one.planned, one.succeeded, outcome == "kept"), outcome


def test_counts_are_those_of_the_attempts(report: EpisodeReport) -> None:
    given = attempts()
    counted = Counter(a.outcome for a in given)
    outcomes = report.results["outcomes"].rows
    assert [row["outcome"] for row in outcomes] == list(OUTCOMES)
    assert {row["outcome"]: row["attempts"] for row in outcomes} == {name: counted[name] for name in OUTCOMES}
    steps = {row["step"]: row["attempts"] for row in report.results["funnel"].rows}
    assert steps["attempted"] == len(given)
    never = sum(counted[name] for name in ("unsettled", "reached_already", "no_room"))
    assert steps["set up and standing"] == len(given) - never
    assert steps["planned and executed"] == sum(a.planned for a in given)
    assert steps["succeeded"] == sum(a.succeeded for a in given)
    assert steps["kept"] == counted["kept"]
    assert f"{counted['kept']} kept; 1 objects have no kept episode" in report.summary


def test_success_by_object_category_grasp_and_robot(report: EpisodeReport) -> None:
    given = attempts()
    for name, key in (
        ("by_object", "twin_id"),
        ("by_category", "category"),
        ("by_grasp_type", "grasp_type"),
        ("by_robot", "robot"),
        ("by_skill", "skill"),
    ):
        rows = report.results[name].rows
        assert len(rows) == len({row[key] for row in rows}) or name == "by_robot"
        for row in rows:
            of = [
                a
                for a in given
                if getattr(a, key) == row[key] and (name != "by_robot" or a.transferred == row["transferred"])
            ]
            executed, succeeded = sum(a.planned for a in of), sum(a.succeeded for a in of)
            assert (row["attempted"], row["executed"], row["succeeded"]) == (len(of), executed, succeeded)
            assert row["kept"] == sum(a.outcome == "kept" for a in of)
            if executed:
                # Wilson's interval by its quadratic equation: (p - k/n)^2 = z^2 p (1 - p) / n at both ends
                for end in (row["low"], row["high"]):
                    left, right = (end - succeeded / executed) ** 2, 1.959963984540054**2 * end * (1 - end) / executed
                    assert left == pytest.approx(right, abs=1e-9)


def test_an_object_that_never_succeeds_is_named(report: EpisodeReport) -> None:
    (row,) = report.results["never_kept"].rows
    assert row["twin_id"] == "hammer_05" and row["succeeded"] == 0
    assert "dropped" in row["outcomes"] and "no_plan" in row["outcomes"]
    assert "hammer_05" in report.text()


def test_plan_failures_are_added_up(report: EpisodeReport) -> None:
    told = Counter[str]()
    for one in attempts():
        told.update(json.loads(one.plan_failures))
    assert {row["reason"]: row["grasps"] for row in report.results["plan_failures"].rows} == dict(told)


def test_lengths_placement_and_failed_grasps(report: EpisodeReport) -> None:
    given = attempts()
    lengths = np.array([a.length_s for a in given if a.outcome == "kept"])
    row = report.results["lengths"].rows[0]
    assert row["mean"] == pytest.approx(lengths.mean()) and row["median"] == pytest.approx(np.median(lengths))
    counted = {row["step"]: row["episodes"] for row in report.results["length_histogram"].rows}
    histogram, _ = np.histogram(lengths, np.arange(5, 10.5, 0.5))
    assert [counted.get(step, 0) for step in range(10, 20)] == histogram.tolist()
    errors = np.array([a.position_error_m for a in given if a.succeeded]) * 1000
    placed = report.results["placement"].rows[0]
    assert placed["p90"] == pytest.approx(np.quantile(errors, 0.9)) and placed["objects"] == len(errors)
    failed = Counter((a.twin_id, a.grasp_id, a.robot) for a in given if a.planned and not a.succeeded)
    rows = report.results["failed_grasps"].rows
    assert {(r["twin_id"], r["grasp_id"], r["robot"]): r["failed"] for r in rows} == dict(failed)


def test_joint_ranges_are_those_of_the_recordings(report: EpisodeReport) -> None:
    rows = report.results["joints"].rows
    assert [row["robot"] for row in rows] == ["panda"] * 7 + ["ur5"] * 6
    positions = np.concatenate([episode(i, steps=40).recording.joint_positions_rad for i in range(4)])
    speeds = np.concatenate([episode(i, steps=40).recording.joint_velocities_rad_s for i in range(4)])
    for place, row in enumerate(rows[:7]):
        assert row["lowest_rad"] == pytest.approx(positions[:, place].min(), abs=1e-6)
        assert row["highest_rad"] == pytest.approx(positions[:, place].max(), abs=1e-6)
        assert row["used"] == pytest.approx(np.ptp(positions[:, place]) / 5.0, abs=1e-6)
        assert row["fastest_rad_s"] == pytest.approx(np.abs(speeds[:, place]).max(), abs=1e-6)


def test_what_could_not_be_set_up_makes_no_object_of_its_own(tmp_path: Path) -> None:
    given = [
        attempt(0),
        attempt(6, outcome="no_room", category=""),
        attempt(1, outcome="no_room", twin_id="", category=""),
    ]
    told = episode_statistics(folder(tmp_path, given)).results
    assert [(row["twin_id"], row["category"], row["attempted"]) for row in told["by_object"].rows] == [
        ("mug_00", "mug", 2)
    ]
    assert told["never_kept"].rows == []
    assert {row["category"]: row["attempted"] for row in told["by_category"].rows} == {"mug": 1, "not told": 2}


def test_the_papers_table_stands_beside_ours(report: EpisodeReport) -> None:
    rows = {row["metric"]: row for row in report.results["beside_the_paper"].rows}
    assert rows["grasp trajectories"]["paper"] == 1e7
    assert rows["mean length, s"]["paper"] == 7.6
    assert rows["objects"]["paper"] == 1e5
    assert (rows["verified grasps"]["here"], rows["verified grasps"]["paper"]) == (None, 5e6)
    assert rows["objects"]["here"] == len({a.twin_id for a in attempts()})
    assert rows["robots"]["here"] == 2


def test_text_and_page_say_the_same_with_equal_bytes(report: EpisodeReport, place: Path, tmp_path: Path) -> None:
    page = report.write(tmp_path / "a").read_text()
    episode_statistics(place).write(tmp_path / "b")
    assert digests_below(tmp_path / "a") == digests_below(tmp_path / "b")
    assert set(digests_below(tmp_path / "a")) == {
        "report.html", "statistics.json",
        *(f"figures/{n}" for n in ("outcomes.svg", "categories.svg", "lengths.svg", "lengths.png", "placement.svg")),
    }  # fmt: skip
    png = (tmp_path / "a/figures/lengths.png").read_bytes()
    width, height = struct.unpack(">II", png[16:24])
    assert png[:4] == b"\x89PNG" and width > 500 and height > 300
    assert report.summary in page and report.summary in report.text()
    assert "http" not in page.replace("http://www.w3.org", "")
    assert "#" * 40 in report.text()


def test_every_number_is_found_again_by_its_sql(report: EpisodeReport, place: Path, tmp_path: Path) -> None:
    report.write(tmp_path)
    told = json.loads((tmp_path / "statistics.json").read_text())
    plain = duckdb.connect()
    plain.execute(told["prelude"])
    plain.execute(f"CREATE VIEW attempts AS SELECT * FROM read_parquet('{place / ATTEMPTS}')")
    asked = {name: query for name, query in told["queries"].items() if name != "joints"}
    assert len(asked) > 14
    for name, query in asked.items():
        rows = plain.sql(query["sql"]).to_arrow_table().to_pylist()
        assert len(rows) == len(query["rows"]), name
        for row, kept in zip(rows, query["rows"], strict=True):
            assert all(row[k] == kept[k] or row[k] == pytest.approx(kept[k], rel=1e-9) for k in row), (name, row, kept)


def test_a_folder_where_nothing_was_kept_or_attempted_can_be_told(tmp_path: Path) -> None:
    nothing = tmp_path / "nothing"
    merge_attempts([], nothing / ATTEMPTS)
    assert "nothing to count" in episode_statistics(nothing).text()
    episode_statistics(nothing).write(nothing / "statistics")
    failed = folder(tmp_path / "failed", [attempt(i, outcome="no_plan") for i in range(4)])
    told = episode_statistics(failed)
    assert "0 planned and executed" in told.text() and "4 objects have no kept episode" in told.summary
    page = told.write(failed / "statistics").read_text()
    assert "mug_00" in page
    with pytest.raises(EpisodesError, match=r"no attempts\.parquet"):
        episode_statistics(tmp_path)
