from pathlib import Path
from typing import Any, ClassVar

import pytest
from pydantic import BaseModel

from manitwin.engine.charges import charge, note_rehearsal, record_charges
from manitwin.engine.lost_charges import lost_usd
from manitwin.engine.stage import Draft
from manitwin.engine.stage_runner import run_stage, stage_key
from manitwin.errors import ManiTwinError, Rejected, Unavailable
from manitwin.pipeline.item import Item


class Settings(BaseModel):
    size: int = 1


class Counting:
    """A stage that counts its runs and writes one field, one file and one folder."""

    name: ClassVar[str] = "counting"
    version: ClassVar[str] = "1"
    reads: ClassVar[tuple[str, ...]] = ("given", "extra?")
    writes: ClassVar[tuple[str, ...]] = ("count", "data.bin", "pictures/")
    needs: ClassVar[str] = "cpu"
    backend = "builtin"
    model = None

    def __init__(self, settings: Settings | None = None, fail: Exception | None = None):
        self.settings, self.fail, self.runs = settings or Settings(), fail, 0

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        self.runs += 1
        (folder / "data.bin").write_bytes(b"x" * self.settings.size)
        if self.fail:
            raise self.fail
        (folder / "pictures").mkdir()
        (folder / "pictures" / "a").write_text("a")
        return {"count": self.runs}


def draft(**fields: Any) -> Draft:
    return Draft("id", Item(file=None, text="t"), seed=0, fields={"given": 1, **fields})


def test_same_key_runs_once_and_gives_the_same_results(tmp_path: Path) -> None:
    stage, first, second = Counting(), draft(), draft()
    run_stage(stage, first, tmp_path)
    run_stage(stage, second, tmp_path)
    assert stage.runs == 1
    assert first.field("count") == second.field("count") == 1
    assert second.path("data.bin").read_bytes() == b"x"
    assert (second.path("pictures/") / "a").read_text() == "a"


def test_key_changes_with_settings_version_seed_backend_and_what_is_read() -> None:
    base = stage_key(Counting(), draft())
    other_seed = draft()
    other_seed.seed = 1
    newer, elsewhere = Counting(), Counting()
    newer.version = "2"  # type: ignore[misc]
    elsewhere.backend = "other"
    keys = {
        base,
        stage_key(Counting(Settings(size=2)), draft()),
        stage_key(Counting(), draft(given=2)),
        stage_key(Counting(), draft(extra=1)),
        stage_key(Counting(), other_seed),
        stage_key(newer, draft()),
        stage_key(elsewhere, draft()),
    }
    assert len(keys) == 7
    assert stage_key(Counting(), draft(unread=1)) == base


@pytest.mark.parametrize("error", [Rejected("empty", "nothing"), RuntimeError("crash")])
def test_failed_stage_leaves_nothing_behind(tmp_path: Path, error: Exception) -> None:
    with pytest.raises(type(error)):
        run_stage(Counting(fail=error), draft(), tmp_path)
    assert list((tmp_path / "counting").iterdir()) == []


def test_what_services_charge_is_kept_and_not_charged_again(tmp_path: Path) -> None:
    class Paid(Counting):
        def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
            charge(0.02)
            return super().run(draft, folder)

    ran, again = run_stage(Paid(), draft(), tmp_path), run_stage(Paid(), draft(), tmp_path)
    assert (ran.cost.cost_usd, ran.reused) == (0.02, False)
    assert (again.cost.cost_usd, again.reused) == (0.02, True)


@pytest.mark.parametrize("error", [Rejected("empty", "nothing"), Unavailable("down")])
def test_what_failed_attempts_were_charged_is_part_of_the_one_that_succeeds(tmp_path: Path, error: Exception) -> None:
    class Paid(Counting):
        def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
            charge(0.02)
            return super().run(draft, folder)

    for _ in range(2):
        with record_charges() as bill, pytest.raises(type(error)):
            run_stage(Paid(fail=error), draft(), tmp_path)
        assert bill.usd == pytest.approx(0.02)
    assert lost_usd(tmp_path / "counting") == pytest.approx(0.04)
    with record_charges() as bill:
        ran = run_stage(Paid(), draft(), tmp_path)
    assert (bill.usd, ran.cost.cost_usd) == (pytest.approx(0.02), pytest.approx(0.06))
    assert lost_usd(tmp_path / "counting") == 0.0


def test_stage_that_does_not_write_what_it_declares_is_a_defect(tmp_path: Path) -> None:
    stage = Counting()
    stage.writes = ("count", "data.bin", "pictures/", "more")  # type: ignore[misc]
    with pytest.raises(ManiTwinError, match="declares"):
        run_stage(stage, draft(), tmp_path)


def test_artifact_that_no_stage_wrote_is_named() -> None:
    with pytest.raises(ManiTwinError, match=r"nothing\.npz"):
        draft().path("nothing.npz")


class Rehearsed(Counting):
    """A stage whose backend is a rehearsal server."""

    name: ClassVar[str] = "rehearsed"
    writes: ClassVar[tuple[str, ...]] = ("count", "data.bin", "pictures/")

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        note_rehearsal()
        return super().run(draft, folder)


def test_a_rehearsed_result_is_one_when_it_is_taken_up_again_and_marks_what_is_made_of_it(tmp_path: Path) -> None:
    first, second = draft(), draft()
    run_stage(Rehearsed(), first, tmp_path)
    run_stage(Counting(), first, tmp_path)
    assert first.rehearsed == {"rehearsed"}
    # a worker that is given the later result alone knows of the earlier stage
    run_stage(Counting(), second, tmp_path)
    assert second.rehearsed == {"rehearsed"}
    plain = draft()
    run_stage(Counting(), plain, tmp_path / "other")
    assert plain.rehearsed == set()


def test_a_rehearsals_rejection_is_marked(tmp_path: Path) -> None:
    made = draft()
    with pytest.raises(Rejected):
        run_stage(Rehearsed(fail=Rejected("none_held", "no")), made, tmp_path)
    assert made.rehearsed == {"rehearsed"}
