"""What annotators do while a server runs, without a browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from manitwin.api import write_index
from manitwin.dataset.index.query import Index
from manitwin.dataset.review.queues import Plan
from manitwin.dataset.review.review_subjects import annotation_text, read_twin
from manitwin.dataset.review.session import ReviewSession
from manitwin.dataset.review.store import ReviewStore
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot
from twin_folders import write_set

ANSWERS = {"category": "yes"}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    root = tmp_path_factory.mktemp("session")
    ids = write_set(root, accepted=3, rejected=0)
    write_index(root, jobs=1)
    return root, ids


@pytest.fixture
def session(made: tuple[Path, list[str]], tmp_path: Path) -> Iterator[ReviewSession]:
    with ReviewStore(tmp_path / "reviews.sqlite") as store:
        yield ReviewSession(store, Index(made[0]), Plan((*made[1], "gone"), 1, overlap=0.0), ["ada", "ben"])


def said(revision: str, request: str = "0123456789") -> dict[str, object]:
    return {"request": request, "revision": revision, "answers": ANSWERS, "seconds": 3.0}


def test_a_queue_ends_when_all_is_judged_and_names_no_twin_that_is_gone(
    made: tuple[Path, list[str]], session: ReviewSession
) -> None:
    seen, root = [], DatasetRoot(made[0])
    for place in range(3):
        twin_id = session.queue("ada")[0]
        assert session.queue("ada", after=twin_id)[0] != twin_id or place == 2
        session.confirm("ada", read_twin(root, twin_id), said(read_twin(root, twin_id).revision, f"{place}" * 8))
        seen.append(twin_id)
    assert sorted(seen) == sorted(made[1]) and session.queue("ada") == session.queue("ben") == []
    assert (session.progress("ada").reviewed, session.progress("ada").left) == (3, 0)
    undone = session.undo("ada", "f" * 8)
    assert undone is not None and undone.review.twin_id == seen[-1] == session.queue("ada")[0]
    assert undone.review.prompts["category"] == "builtin" and not undone.review.blind


def test_what_is_left_for_later_is_behind_all_others(made: tuple[Path, list[str]], session: ReviewSession) -> None:
    first, second, third = session.queue("ada")
    assert session.queue("ada", after=first) == [second, third, first]
    assert session.queue("ada", after=second) == [third, first, second] == session.queue("ada", after="gone")
    assert session.queue("ada", after=first) == [third, second, first] == session.queue("ada")


def test_a_blind_annotator_is_told_a_mass_without_its_interval(made: tuple[Path, list[str]]) -> None:
    record = read_twin(DatasetRoot(made[0]), made[1][0])
    seen, blind = annotation_text(record, "physical"), annotation_text(record, "physical", blind=True)
    assert " to " in seen and " to " not in blind and blind.split(" kg")[0] == seen.split(" kg")[0]


def test_what_is_wrong_is_refused_and_nothing_is_kept(made: tuple[Path, list[str]], session: ReviewSession) -> None:
    record = read_twin(DatasetRoot(made[0]), made[1][0])
    for change, why in (
        ({"revision": "another"}, "rebuilt since it was shown"),
        ({"answers": {"category": "perhaps"}}, "'yes', 'no' or 'unsure'"),
        ({"answers": {}}, "no dimension is answered"),
        ({"request": "x"}, "request"),
        ({"corrections": {"points": {"f9": 0}}, "answers": {"functional": "no"}}, "unknown point"),
        ({"more": 1}, "more"),
    ):
        with pytest.raises(UsageError, match=why):
            session.confirm("ada", record, {**said(record.revision), **change})
    assert session.store.standing() == []
    with pytest.raises(UsageError, match="not a valid annotator name"):
        ReviewSession(session.store, Index(made[0]), session.plan, ["a b"])
