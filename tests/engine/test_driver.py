"""What the driver does with items, results and failures; workers are this process."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from rehearsals import rehearse, runs

from manitwin.config import RunConfig
from manitwin.dataset.index.parts import indexed_twins
from manitwin.engine.events import StageEnded, StageEvent
from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.recipe import Identity
from manitwin.errors import Rejected
from manitwin.pipeline.item import Item
from manitwin.twin.dataset_root import twin_name
from rehearsal_recipe import RehearsalRecipe


@pytest.fixture
def recipe(tmp_path: Path) -> RehearsalRecipe:
    return RehearsalRecipe(log=tmp_path / "log")


def folders(root: Path) -> set[str]:
    return {path.parent.name for path in (root / "twins").glob("*/*/twin.json")}


def test_every_item_ends_once_with_a_folder_and_a_row_in_the_tables(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    run = rehearse(tmp_path / "d", [f"item {n}" for n in range(7)] + ["bad reject:b"], recipe=recipe)
    assert run.result.stopped is None and run.result.left == 0 and run.wrong == []
    assert sorted(event.task.number for event in run.ended) == list(range(1, 9))
    assert sorted(run.states.values()) == ["accepted"] * 7 + ["rejected"]
    assert len(folders(tmp_path / "d")) == 8
    assert set(indexed_twins(run.root)) == folders(tmp_path / "d")
    counts = runs(tmp_path / "log")
    assert set(counts.values()) == {1} and len(counts) == 7 * 3 + 2, "nothing follows the stage that rejects"


def test_a_second_run_does_nothing(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    rehearse(tmp_path / "d", ["one", "two"], recipe=recipe)
    again = rehearse(tmp_path / "d", ["one", "two", "three"], recipe=recipe)
    assert [event.task.payload.text for event in again.ended] == ["three"]
    assert set(runs(tmp_path / "log").values()) == {1}


def test_a_changed_stage_is_done_again_with_what_follows_and_nothing_else(
    tmp_path: Path, recipe: RehearsalRecipe
) -> None:
    first = rehearse(tmp_path / "d", ["one", "bad reject:a"], recipe=recipe)
    changed = rehearse(tmp_path / "d", recipe=replace(recipe, versions=(("b", "2"),)))
    twins = {event.task.payload.text: event.task.item_id for event in first.ended}
    counts = runs(tmp_path / "log")
    assert {stage: counts[twins["one"], stage] for stage in "abc"} == {"a": 1, "b": 2, "c": 2}
    assert counts[twins["bad reject:a"], "b"] == 0, "what a rejects, b never sees"
    assert changed.wrong == []
    back = rehearse(tmp_path / "d", recipe=recipe)  # the results of before are still there
    assert runs(tmp_path / "log")[twins["one"], "b"] == 2
    assert back.states["one"] == "accepted" and back.wrong == []


def test_two_items_of_one_twin_make_one_folder(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    run = rehearse(tmp_path / "d", ["same"], recipe=recipe)
    assert run.states == {"same": "accepted"}
    from manitwin.engine.ledger.ledger import Ledger

    ledger = Ledger(tmp_path / "d" / "ledger.sqlite")
    ledger.add_items([Item(file=None, text="same", license="MIT")])  # the licence is not part of who a twin is
    ledger.close()
    again = rehearse(tmp_path / "d", recipe=recipe)
    assert [event.state for event in again.ended] == ["duplicate"]
    assert "item 1" in again.ended[0].detail
    assert len(folders(tmp_path / "d")) == 1 and again.wrong == []


def test_the_rejection_of_what_stood_in_an_inputs_place_goes_when_the_input_is_changed(
    tmp_path: Path, recipe: RehearsalRecipe
) -> None:
    input_file = tmp_path / "box.obj"

    class OfBytes(RehearsalRecipe):
        """Tells its items by the bytes of a file, and refuses those that say so."""

        def identify(self, payload: Item) -> Identity:
            said = input_file.read_text()
            refused = Rejected("degenerate", said, "gate") if said == "broken" else None
            return Identity(f"{sum(said.encode()):016x}", "text", refused)

    recipe = OfBytes(log=tmp_path / "log")
    input_file.write_text("broken")
    first = rehearse(tmp_path / "d", ["box"], recipe=recipe)
    assert first.states == {"box": "rejected"} and len(indexed_twins(first.root)) == 1
    input_file.write_text("a box")
    with closing(Ledger(tmp_path / "d" / "ledger.sqlite")) as ledger:
        ledger.reopen([1])
    second = rehearse(tmp_path / "d", recipe=recipe)
    assert second.states == {"box": "accepted"} and second.wrong == []
    assert len(folders(tmp_path / "d")) == 1 and set(indexed_twins(second.root)) == folders(tmp_path / "d")


def test_inputs_that_were_alike_for_a_while_are_told_apart_once_they_are_changed(
    tmp_path: Path, recipe: RehearsalRecipe
) -> None:
    inputs = tmp_path / "inputs"
    inputs.mkdir()

    class OfBytes(RehearsalRecipe):
        """Tells its items by the bytes of a file each."""

        def identify(self, payload: Item) -> Identity:
            said = (inputs / str(payload.text)).read_text()
            refused = Rejected("degenerate", said, "gate") if said == "cut" else None
            return Identity(f"{sum(said.encode()):016x}", "text", refused)

    recipe = OfBytes(log=tmp_path / "log")
    for name in ("one", "two"):
        (inputs / name).write_text("cut")
    first = rehearse(tmp_path / "d", ["one", "two"], recipe=recipe)
    assert sorted(first.states.values()) == ["duplicate", "rejected"]
    for name in ("one", "two"):
        (inputs / name).write_text(f"box {name}")
    with closing(Ledger(tmp_path / "d" / "ledger.sqlite")) as ledger:
        assert ledger.reopen([1, 2]) == 2
    second = rehearse(tmp_path / "d", recipe=recipe)
    assert set(second.states.values()) == {"accepted"} and second.wrong == []


def test_what_fails_is_tried_three_times_and_quarantined_with_its_error(
    tmp_path: Path, recipe: RehearsalRecipe
) -> None:
    run = rehearse(tmp_path / "d", ["bad raise:b", "good"], recipe=recipe)
    assert run.states == {"bad raise:b": "failed", "good": "accepted"}
    assert run.attempts["bad raise:b", "b"] == 3
    assert "the text says so" in (run.errors["bad raise:b", "b"] or "")
    assert "b failed 3 times" in run.ended[-1].detail
    again = rehearse(tmp_path / "d", recipe=recipe)
    assert again.ended == [], "a failed item waits for a person"


def test_a_service_that_is_down_costs_no_attempt_and_leaves_its_items_to_the_next_run(
    tmp_path: Path, recipe: RehearsalRecipe
) -> None:
    down = tmp_path / "down"
    down.touch()
    recipe = replace(recipe, plan=(("a", "cpu"), ("ask", "vlm"), ("c", "cpu")))
    texts = [f"item {n} unavailable:ask:{down}" for n in range(5)]
    left_s: list[float | None] = []

    def told(event: StageEvent) -> None:
        if isinstance(event, StageEnded) and event.state == "waiting":
            left_s.append(event.given_up_in_s)

    settings = RunConfig(patience_s=0.2)
    first = rehearse(tmp_path / "d", texts, recipe=recipe, settings=settings, on_stage=told)
    assert left_s[0] is not None and 0 <= left_s[0] <= 0.2, "how long it is still asked is told"
    assert first.result.left == 5 and set(first.states.values()) == {"open"} and first.wrong == []
    assert all(first.attempts[text, "ask"] == 0 for text in texts if (text, "ask") in first.attempts)
    counts = runs(tmp_path / "log")
    assert sum(count for (_, stage), count in counts.items() if stage == "a") == 5, "what can be done is done"
    down.unlink()
    second = rehearse(tmp_path / "d", recipe=recipe)
    assert set(second.states.values()) == {"accepted"} and second.wrong == []
    assert {count for (_, stage), count in runs(tmp_path / "log").items() if stage != "ask"} == {1}


def test_a_short_failure_of_a_service_is_waited_for(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    down = tmp_path / "down"
    down.touch()
    asked = []

    class Repaired(RehearsalRecipe):
        def stages(self, kind: str):  # type: ignore[no-untyped-def]
            stages = super().stages(kind)
            act = stages[1]._act

            def once(what: str, more: str, twin: str) -> None:
                asked.append(what)
                try:
                    act(what, more, twin)
                finally:
                    down.unlink(missing_ok=True)

            stages[1]._act = once
            return stages

    run = rehearse(
        tmp_path / "d",
        [f"a unavailable:b:{down}", f"b limited:b:{down}"],
        recipe=Repaired(log=recipe.log),
        settings=RunConfig(patience_s=30),
    )
    assert set(run.states.values()) == {"accepted"} and len(asked) == 3
    assert set(run.attempts.values()) == {1}


def test_a_lost_folder_is_found_missing_and_made_again_from_its_stages(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    import shutil

    from manitwin.dataset.check import disagreements
    from manitwin.engine.ledger.ledger import Ledger

    run = rehearse(tmp_path / "d", ["one", "two"], recipe=recipe)
    shutil.rmtree(tmp_path / "d" / twin_name(run.ended[0].task.item_id))
    ledger = Ledger(tmp_path / "d" / "ledger.sqlite")
    found = list(disagreements(ledger, run.root, True))
    assert len(found) == 1 and "its folder is missing" in found[0].what
    for each in found:
        assert each.repair is not None
        each.repair()
    ledger.close()
    again = rehearse(tmp_path / "d", recipe=recipe)
    assert again.wrong == [] and len(again.ended) == 1
    assert set(runs(tmp_path / "log").values()) == {1}


def test_a_result_that_is_not_there_is_done_again(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    from manitwin.dataset.check import disagreements
    from manitwin.engine.ledger.ledger import Ledger

    run = rehearse(tmp_path / "d", ["one"], recipe=recipe)
    next((tmp_path / "d" / ".work" / run.ended[0].task.item_id / "b").glob("*/result.json")).write_text("{ half")
    ledger = Ledger(tmp_path / "d" / "ledger.sqlite")
    assert [f.what for f in disagreements(ledger, run.root, True)] == [
        "item 1, stage b: done in the ledger, but its result is missing"
    ]
    ledger.close()


def test_work_is_dropped_where_nobody_wants_to_resume(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    run = rehearse(tmp_path / "d", ["one"], recipe=recipe, settings=RunConfig(keep_work=False))
    assert run.wrong == [] and list((tmp_path / "d" / ".work").iterdir()) == []


def test_tables_may_be_left_to_another_command(tmp_path: Path, recipe: RehearsalRecipe) -> None:
    run = rehearse(tmp_path / "d", ["one"], recipe=recipe, settings=RunConfig(index_every=0))
    assert run.states == {"one": "accepted"} and run.wrong == []
    assert indexed_twins(run.root) == {}
    again = rehearse(tmp_path / "d", recipe=recipe)
    assert len(indexed_twins(again.root)) == 1
