"""Jobs on a cluster: workers crash and hang, services are down, and each job costs itself alone."""

from __future__ import annotations

import sys
import threading
from collections import Counter
from pathlib import Path

import pytest
from cluster_runs import asking, executor_for, replies, replies_after, run, stage_job, times_run

from manitwin.engine.events import ItemEnded
from manitwin.engine.jobs import Failure
from manitwin.errors import Unavailable, UsageError
from rehearsal_recipe import RehearsalRecipe


@pytest.mark.slow
def test_a_crash_costs_its_item_alone(connected: str, tmp_path: Path, recipe: RehearsalRecipe) -> None:
    failing = {"poisoned segfault:b": "failed", "broken raise:a": "failed", "poor reject:b": "rejected"}
    texts = [f"good {n}" for n in range(8)] + ["once segfault-once:c", *failing]
    ran = run(tmp_path, texts, recipe=recipe, address=connected)
    assert {text: state for text, state in ran.states.items() if state != "accepted"} == failing
    assert max(Counter(event.task.number for event in ran.ended).values()) == 1, "each ended once"
    crash = ran.errors["poisoned segfault:b", "b"] or ""
    assert "Segmentation fault" in crash and "rehearsal_recipe.py" in crash, "the native stack is kept"
    assert (ran.attempts["poisoned segfault:b", "b"], ran.attempts["once segfault-once:c", "c"]) == (3, 2)
    repeated = sorted((what.split()[1], times) for what, times in times_run(tmp_path / "log").items() if times > 1)
    assert repeated == [("a", 3), ("b", 3), ("c", 2)], "three attempts of what fails, two of what failed once"
    assert ran.wrong == []


@pytest.mark.slow
def test_a_stage_that_hangs_is_given_up(
    connected: str, tmp_path: Path, recipe: RehearsalRecipe, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with executor_for(Path("relative"), recipe, connected, cpu=1, stage_timeout_s=2.0) as executor:
        for ticket, text in enumerate(["hang:a", "next"]):
            executor.submit(ticket, stage_job(ticket, text, recipe))
        answers = dict(replies(executor, 2))
    assert isinstance(answers[0], Failure) and answers[0].kind == "timeout"
    assert "stage_timeout_s = 2" in answers[0].message
    assert not isinstance(answers[1], Failure), "the one behind it is done by a new worker"
    assert len(list((tmp_path / "relative" / ".work").glob("*/a/*/result.json"))) == 1, "where the driver was started"


@pytest.mark.slow
def test_items_that_wait_for_a_service_hold_no_core(connected: str, tmp_path: Path) -> None:
    down, limit, order = tmp_path / "down", tmp_path / "limit", list[str]()
    down.touch()
    limit.touch()
    others = {f"good {n} reject:a" for n in range(8)}

    def heard(event: ItemEnded) -> None:
        order.append(event.task.payload.text or "")
        if len(order) == len(others):
            down.unlink()
            threading.Timer(1.0, limit.unlink).start()

    waiting = [f"{n} unavailable:b:{down} limited:b:{limit}" for n in range(4)]
    ran = run(
        tmp_path, [*waiting, *sorted(others)], recipe=asking(tmp_path / "log"), address=connected, on_ended=heard
    )  # fmt: skip
    assert set(order[:8]) == others, "the others ended while it was down"
    assert {ran.states[text] for text in waiting} == {"accepted"}, "then while it asked to wait, and at last"
    assert {ran.attempts[text, "b"] for text in waiting} == {1}, "which is nobody's attempt"


@pytest.mark.slow
def test_of_the_threads_of_a_worker_only_the_one_that_crashed_it_is_blamed(connected: str, tmp_path: Path) -> None:
    recipe = RehearsalRecipe((("a", "vlm"),), log=tmp_path / "log")
    with executor_for(tmp_path, recipe, connected) as executor:
        texts = ["sleep:a:0.3 segfault:a sleep:a:1.5", *(f"{n} sleep:a:1.5" for n in range(3))]
        for ticket, text in enumerate(texts):
            executor.submit(ticket, stage_job(ticket, text, recipe))
        answers = dict(replies(executor, len(texts)))
    assert isinstance(answers[0], Failure) and answers[0].kind == "died"
    assert not any(isinstance(answers[n], Failure) for n in (1, 2, 3))


@pytest.mark.slow
def test_of_the_threads_of_a_worker_only_the_one_that_hangs_is_given_up(connected: str, tmp_path: Path) -> None:
    recipe = RehearsalRecipe((("a", "vlm"),), log=tmp_path / "log")
    with executor_for(tmp_path, recipe, connected, stage_timeout_s=3.0) as executor:
        executor.submit(0, stage_job(0, "hang:a", recipe))
        list(replies_after(executor, 2.0))
        executor.submit(1, stage_job(1, "sleep:a:2", recipe))
        answers = dict(replies(executor, 2))
        executor.submit(2, stage_job(2, "next", recipe))
        answers |= dict(replies(executor, 1))
    assert isinstance(answers[0], Failure) and answers[0].kind == "timeout"
    assert not any(isinstance(answers[n], Failure) for n in (1, 2))
    assert set(times_run(tmp_path / "log").values()) == {1}


@pytest.mark.slow
def test_workers_of_another_version_are_refused(
    connected: str, tmp_path: Path, recipe: RehearsalRecipe, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("manitwin.engine.executors.ray_cluster.installed_version", lambda: "9.9")
    monkeypatch.setattr("manitwin.engine.executors.ray_pool.FAILED_STARTS", 2)
    with executor_for(tmp_path, recipe, connected) as executor:
        executor.submit(0, stage_job(0, "good", recipe))
        with pytest.raises(Unavailable, match=r"this node has manitwin .*, but the driver has 9\.9"):
            list(replies(executor, 1))


def test_waiting_for_a_worker_that_cannot_come_ends(
    connected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("manitwin.engine.executors.ray_pool.START_PATIENCE_S", 1.0)
    recipe = RehearsalRecipe((("a", "gpu"),), log=tmp_path / "log")
    with executor_for(tmp_path, recipe, connected) as executor:
        executor.submit(0, stage_job(0, "good", recipe))
        ((_, reply),) = list(replies(executor, 1))
    assert isinstance(reply, Failure) and reply.kind == "unavailable" and "ray status" in reply.message


def test_without_ray_the_remedy_is_said(
    tmp_path: Path, recipe: RehearsalRecipe, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(UsageError, match=r"pip install manitwin\[ray\]"):
        executor_for(tmp_path, recipe, "auto")


def test_addresses_where_nobody_answers_are_refused_at_once() -> None:
    from manitwin.engine.executors.ray_cluster import check_head_address

    with pytest.raises(UsageError, match="host:port"):
        check_head_address("ray://head:10001")
    with pytest.raises(Unavailable, match=r"no Ray cluster answers at 127\.0\.0\.1:9"):
        check_head_address("127.0.0.1:9")
