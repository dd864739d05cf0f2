"""What a run spends: counted once, kept where an attempt fails, and held to a limit."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from rehearsals import Rehearsed, rehearse

from manitwin.engine.charges import Budget
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.store import RUN
from rehearsal_recipe import RehearsalRecipe

PLAN = (("a", "cpu"), ("b", "vlm"), ("c", "cpu"))
TEXTS = [f"charge:b:0.02 {number}" for number in range(10)]


def recorded_usd(done: Rehearsed, twin_id: str) -> float:
    run = json.loads(done.root.read_bytes(f"{twin_name(twin_id)}/{RUN}"))
    return float(sum(stage["cost_usd"] for stage in run["stages"].values()))


@pytest.mark.parametrize("processes", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_run_stops_asking_at_its_limit_and_goes_on_where_it_was_left(tmp_path: Path, processes: bool) -> None:
    recipe = RehearsalRecipe(PLAN, usd=0.02)
    first = rehearse(tmp_path, TEXTS, recipe=recipe, max_cost_usd=0.07, processes=processes)
    assert [event.state for event in first.ended] == ["accepted"] * 3
    assert first.result.stopped is not None and "at most 0.07 USD" in first.result.stopped and first.result.left == 7
    assert sum(first.costs_usd.values()) == pytest.approx(0.06) and first.wrong == []
    second = rehearse(tmp_path, recipe=recipe, processes=processes)
    assert set(second.states.values()) == {"accepted"} and second.result.stopped is None
    assert sum(second.costs_usd.values()) == pytest.approx(0.2)


def test_what_costs_nothing_ends_although_there_is_no_money(tmp_path: Path) -> None:
    recipe = RehearsalRecipe((("a", "vlm"), ("b", "cpu")), usd=0.02)
    paid = rehearse(tmp_path, ["charge:a:0.02 x raise:b"], recipe=recipe)
    assert set(paid.states.values()) == {"failed"}
    recipe = RehearsalRecipe((("a", "vlm"), ("b", "cpu")), usd=0.02, versions=(("b", "2"),))
    again = rehearse(tmp_path, ["y"], recipe=recipe, max_cost_usd=0.01)
    assert again.result.left == 1, "the new item waits for money"
    assert again.attempts[("charge:a:0.02 x raise:b", "b")] == 3, "the paid one was tried again"


@pytest.mark.parametrize("fault", ["unavailable", "limited", "denied"])
def test_what_was_charged_in_vain_is_part_of_the_twins_cost(tmp_path: Path, fault: str) -> None:
    sign = tmp_path / "sign"
    sign.touch()
    text = f"charge:b:0.02 {fault}:b:{sign}"
    recipe = RehearsalRecipe(PLAN, usd=0.02)
    if fault == "limited":
        assert rehearse(tmp_path / "d", [text], recipe=recipe, max_cost_usd=0.05).result.left == 1, "two of 0.02 fit"
    else:
        rehearse(tmp_path / "d", [text], recipe=recipe)
    sign.unlink()
    done = rehearse(tmp_path / "d", recipe=recipe)
    assert set(done.states.values()) == {"accepted"}
    tries = {"unavailable": 2, "limited": 3, "denied": 2}[fault]
    assert recorded_usd(done, done.ended[0].task.item_id) == pytest.approx(0.02 * tries)


def test_a_refused_key_stops_the_run_and_costs_no_attempt(tmp_path: Path) -> None:
    sign = tmp_path / "sign"
    sign.touch()
    text = f"denied:b:{sign}"
    stopped = rehearse(tmp_path / "d", [text, *TEXTS], recipe=RehearsalRecipe(PLAN))
    assert stopped.result.stopped is not None and "refused while" in stopped.result.stopped
    assert stopped.attempts[(text, "b")] == 0 and stopped.states[text] == "open"


def test_the_limit_counts_what_is_under_way() -> None:
    budget = Budget(1.0)
    budget.begin(1, 0.6)
    assert not budget.allows(0.5) and budget.allows(0.4) and budget.allows(0.0) and not budget.has_no_running_jobs
    budget.end(1, 0.1)
    assert budget.allows(0.9) and not budget.allows(0.95) and budget.has_no_running_jobs
    assert Budget(None).allows(1e9)
