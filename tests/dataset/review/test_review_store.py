"""What was confirmed stays: undone by another event, through kills, sent twice, from many threads."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import pytest
from pydantic import ValidationError

from hostile_schemas import ENDLESS
from manitwin.dataset.review.queues import Plan
from manitwin.dataset.review.schema import MIGRATIONS
from manitwin.dataset.review.store import ReviewStore
from manitwin.dataset.review.verdicts import Review, reason_of
from manitwin.errors import UsageError

WRITER = """
import sys
from pathlib import Path
from manitwin.dataset.review.store import ReviewStore
from manitwin.dataset.review.verdicts import Review

with ReviewStore(Path(sys.argv[1])) as store:
    number = 0
    while True:
        review = Review(annotator="ada", twin_id=f"t{number}", revision="r", answers={"category": "yes"}, note="x" * 3000)
        store.add([review], [f"{number}"])
        sys.stdout.write(f"{number}\\n")
        sys.stdout.flush()
        number += 1
"""


def review(twin_id: str = "t0", answer: str = "yes", annotator: str = "ada", revision: str = "r0") -> Review:
    return Review.model_validate(
        {"annotator": annotator, "twin_id": twin_id, "revision": revision, "answers": {"category": answer}}
    )


@pytest.fixture
def store(tmp_path: Path) -> Iterator[ReviewStore]:
    with ReviewStore(tmp_path / "reviews.sqlite") as store:
        yield store


def test_a_kill_at_any_moment_loses_nothing_that_was_confirmed(tmp_path: Path) -> None:
    path = tmp_path / "reviews.sqlite"
    for confirmations in (1, 23):
        program = subprocess.Popen([sys.executable, "-c", WRITER, path], stdout=subprocess.PIPE, text=True)
        assert program.stdout is not None
        said = [program.stdout.readline() for _ in range(confirmations)]
        os.kill(program.pid, signal.SIGKILL)
        said += program.stdout.readlines()  # what it confirmed until it died
        program.stdout.close()
        program.wait()
        last = int([line for line in said if line.endswith("\n")][-1])
        with ReviewStore(path) as store:
            there = {each.review.twin_id for each in store.standing()}
            assert {f"t{number}" for number in range(last + 1)} <= there
        with closing(sqlite3.connect(path)) as connection:
            assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)


def test_events_can_neither_be_changed_nor_removed(store: ReviewStore) -> None:
    store.add([review()], ["1"])
    with closing(sqlite3.connect(store.path)) as connection:
        for statement in ("UPDATE events SET annotator = 'eve'", "DELETE FROM events"):
            with pytest.raises(sqlite3.IntegrityError, match="only appended"):
                connection.execute(statement)


def test_undo_goes_back_as_far_as_there_are_reviews_and_keeps_what_was_typed(store: ReviewStore) -> None:
    for place, answer in enumerate(("yes", "no", "unsure")):
        store.add([review("t0", answer)], [f"{place}"])
    store.add([review("t1", annotator="ben")], ["ben"])
    assert [each.review.answers["category"] for each in store.standing()] == ["unsure", "yes"]
    for place, left in enumerate(("no", "yes", None)):
        undone = store.undo("ada", f"undo {place}")
        assert undone is not None and undone.review.twin_id == "t0"
        assert store.undo("ada", f"undo {place}") == undone, "sent again it takes back nothing more"
        stands = store.of_twin("t0", "ada")
        assert (None if stands is None else stands.review.answers["category"]) == left
    assert store.draft("ada", "t0") == review("t0", "yes").model_dump(mode="json")
    assert store.undo("ada", "undo 3") is None
    assert store.undo_counts() == {"ada": 3} and len(store.standing()) == 1
    store.add([review("t0", "no")], ["again"])
    assert store.draft("ada", "t0") is None and len(store.standing()) == 2


def test_sent_twice_it_counts_once_and_many_or_none(store: ReviewStore) -> None:
    assert store.add([review("t0"), review("t1")], ["a", "b"]) == 2
    assert store.add([review("t0"), review("t2")], ["a", "c"]) == 1
    with pytest.raises(ValueError):
        store.add([review("t3"), review("t4")], ["d"])
    assert [each.review.twin_id for each in store.standing()] == ["t0", "t1", "t2"]


def test_a_twin_built_anew_has_verdicts_of_its_own(store: ReviewStore) -> None:
    store.add([review("t0", revision="r0"), review("t0", "no", revision="r1")], ["a", "b"])
    assert store.annotators_by_revision() == {"t0": {"r0": {"ada"}, "r1": {"ada"}}}
    assert len(store.standing()) == 2


def test_two_hundred_annotators_lose_nothing(store: ReviewStore) -> None:
    def judge(number: int) -> None:
        store.put_draft(f"a{number}", "t", {"answers": {}})
        store.add([review("t", annotator=f"a{number}")], [f"{number}"])

    with ThreadPoolExecutor(16) as pool:
        list(pool.map(judge, range(200)))
    assert len(store.standing()) == 200


def test_sample_and_annotators_are_kept(store: ReviewStore) -> None:
    plan = Plan(("t1", "t0"), 1, 0.5)
    store.add_plan(Plan(("t9",), 1))
    store.add_plan(plan)
    store.add_plan(plan)
    store.add_annotator("ada")
    store.add_annotator("ada")
    with ReviewStore(store.path, make=False) as again:
        assert (again.plan(), again.annotators()) == (plan, ["ada"])


def test_what_is_no_store_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no reviews yet"):
        ReviewStore(tmp_path / "none.sqlite", make=False)
    (tmp_path / "text.sqlite").write_text("no database at all" * 100)
    with pytest.raises(UsageError, match="not a readable review store"):
        ReviewStore(tmp_path / "text.sqlite")
    (tmp_path / "link.sqlite").symlink_to("/etc/hostname")
    with pytest.raises(UsageError, match="leads outside its folder"):
        ReviewStore(tmp_path / "link.sqlite")


@pytest.mark.parametrize("own", ENDLESS)
def test_a_store_with_a_schema_of_its_own_is_refused_before_it_is_asked(own: str, store: ReviewStore) -> None:
    with closing(sqlite3.connect(store.path)) as changed:
        changed.executescript(own.replace("$NAME", "drafts"))
    with pytest.raises(UsageError, match="do not match those of a store of reviews"):
        ReviewStore(store.path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"answers": {}}, "no dimension is answered"),
        ({"answers": {"colour": "yes"}}, "colour"),
        ({"answers": {"category": "maybe"}}, "'yes', 'no' or 'unsure'"),
        ({"corrections": {"category": "mug"}}, "corrected and not answered 'no'"),
        ({"corrections": {"mass_kg": {"value": -1, "low": -1, "high": 1}}}, "greater than 0"),
        ({"corrections": {"mass_kg": {"value": 2, "low": 1, "high": 1.5}}}, "outside"),
        ({"corrections": {"points": {"x9": 1}}}, "ids are f0"),
        ({"annotator": "a b"}, "not a valid annotator name"),
        ({"note": "bell\x07"}, "control characters"),
        ({"seconds": float("nan")}, "finite"),
        ({"twin_id": "../t"}, "no name for a folder"),
    ],
)
def test_a_verdict_that_makes_no_sense_is_refused(change: dict[str, object], said: str) -> None:
    with pytest.raises(ValidationError) as error:
        Review.model_validate({**review().model_dump(), **change})
    assert said in reason_of(error.value)


def test_reviews_stand_for_what_followed_the_revision_that_was_seen(store: ReviewStore) -> None:
    store.add([review(revision="r0"), review(annotator="bob", revision="r0")], ["1", "2"])
    store.record_successors({"t0": ("r0", "r1")})
    store.record_successors({"t0": ("r1", "r2"), "t9": ("r0", "r9")})
    assert {stored.review.revision for stored in store.standing()} == {"r2"}
    assert store.annotators_by_revision() == {"t0": {"r2": {"ada", "bob"}}}
    store.add([review(answer="no", revision="r2")], ["3"])
    told = {stored.review.annotator: stored.review.answers["category"] for stored in store.standing()}
    assert told == {"ada": "no", "bob": "yes"}, "the later of two of one person counts"
    stored = store.of_twin("t0", "bob")
    assert stored is not None and stored.review.revision == "r2"


def test_revisions_that_follow_each_other_in_a_circle_end(store: ReviewStore) -> None:
    store.add([review(revision="r0")], ["1"])
    store.record_successors({"t0": ("r0", "r1")})
    store.record_successors({"t0": ("r1", "r0")})
    assert [stored.review.revision for stored in store.standing()] == ["r1"]


def test_a_store_of_the_first_schema_is_brought_to_this_one(tmp_path: Path) -> None:
    path = tmp_path / "reviews.sqlite"
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript(f"{MIGRATIONS[0]}; PRAGMA user_version = 1;")
    with ReviewStore(path) as store:
        store.add([review()], ["1"])
        assert len(store.standing()) == 1
