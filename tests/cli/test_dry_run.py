"""A dry run: what would be done, what that would cost, and not a byte written."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from typer.testing import CliRunner

from json_documents import check_keys
from manitwin.cli.build_plan import dataset_rate
from manitwin.cli.main import app
from manitwin.cli.measured_rates import (
    CHAIN_CPU_S,
    DOUBTS_CPU_S,
    FURTHER_PHOTO_CPU_S,
    ROBUSTNESS_CPU_S,
    SECOND_ENGINE_CPU_S,
    TRIALS_CPU_S,
    measured_rate,
)
from manitwin.config import BuildConfig
from manitwin.engine.ledger.ledger import LEDGER, Ledger
from manitwin.engine.ledger.location import ledger_path
from manitwin.engine.ledger.rows import ItemState
from manitwin.errors import UsageError
from manitwin.pipeline.item import Item
from manitwin.pipeline.recipe import TwinRecipe
from manitwin.pipeline.settings import with_flags
from manitwin.twin.dataset_root import DatasetRoot


def manitwin(*arguments: object, exit_status: int = 0) -> str:
    done = CliRunner().invoke(app, [*map(str, arguments)])
    assert done.exit_code == exit_status, done.output
    return done.stdout


def tree(folder: Path) -> dict[str, tuple[int, bytes]]:
    """Every file and folder with its time and content."""
    return {
        str(path.relative_to(folder)): (path.stat().st_mtime_ns, path.read_bytes() if path.is_file() else b"")
        for path in sorted(folder.rglob("*"))
    }


@pytest.fixture
def inputs(tmp_path: Path) -> Path:
    folder = tmp_path / "inputs"
    folder.mkdir()
    trimesh.creation.box([0.04, 0.06, 0.1]).export(folder / "box.stl")
    Image.fromarray(np.full((64, 64, 3), 200, np.uint8)).save(folder / "photo.png")
    Image.fromarray(np.zeros((8, 8, 3), np.uint8)).save(folder / "dot.png")
    frames = [Image.fromarray(np.full((64, 64, 3), grey, np.uint8)) for grey in (0, 255)]
    frames[0].save(folder / "moves.gif", save_all=True, append_images=frames[1:])
    (folder / "empty.png").write_bytes(b"")
    (tmp_path / "list.csv").write_text(
        "file,name,units\ninputs/box.stl,box,m\ninputs/photo.png,,\ninputs/dot.png,,\ninputs/moves.gif,,\n"
        "inputs/empty.png,mug,\ninputs/box.stl,box,m\n"
    )
    return tmp_path / "list.csv"


STATES = ["to_build", "to_build", "would_be_rejected", "would_be_rejected", "would_be_rejected"]


def test_it_names_every_input_and_writes_nothing(inputs: Path, tmp_path: Path) -> None:
    before = tree(tmp_path)
    document: dict[str, Any] = json.loads(
        manitwin("build", inputs, "-o", tmp_path / "out", "--dry-run", "--quick", "--json")
    )
    text = manitwin("build", inputs, "-o", tmp_path / "out", "--dry-run", "--quick")
    assert tree(tmp_path) == before and not (tmp_path / "out").exists()

    check_keys(document, "build --dry-run")
    assert [item["state"] for item in document["items"]] == STATES
    assert [item["kind"] for item in document["items"]] == ["mesh", *["image"] * 4]
    assert (document["items"][0]["name"], document["items"][0]["units"]) == ("box", "m")
    reasons = [item["detail"].partition(":")[0] for item in document["items"][2:]]
    assert reasons == ["too_small", "animated", "empty"]
    assert (
        document["estimate"]["cpu_seconds"] == pytest.approx(CHAIN_CPU_S["mesh"] + CHAIN_CPU_S["image"])
        and document["estimate"]["cost_usd"] == 0
    )
    assert "measured/cost.md" in document["estimate"]["each"]["mesh"]["source"]
    assert "2 to build, 3 would be rejected" in text and "about 0:00:14 of CPU time" in text and "0.00 USD" in text
    assert "box.stl (box, units m)" in text


def test_what_is_there_is_not_built_again_and_stays_as_it_is(inputs: Path, tmp_path: Path) -> None:
    bad, out = tmp_path / "inputs/empty.png", tmp_path / "out"
    manitwin("build", bad, "-o", out, "--quick", "--executor", "inline", exit_status=3)
    before = tree(tmp_path)
    again = json.loads(manitwin("build", bad, tmp_path / "inputs/box.stl", "-o", out, "--quick", "--dry-run", "--json"))
    assert {Path(item["file"]).name: item["state"] for item in again["items"]} == {
        "empty.png": "rejected", "box.stl": "to_build"
    }  # fmt: skip
    assert again["items"][0]["detail"].startswith("empty: ") and tree(tmp_path) == before
    other = json.loads(manitwin("build", bad, "-o", out, "--quick", "--seed", 5, "--dry-run", "--json"))
    assert other["counts"]["would_be_rejected"] == 1, "another seed makes other twins"
    assert "1 rejected already" in manitwin("build", "-o", out, "--dry-run"), "with no inputs: what is there"
    assert tree(tmp_path) == before


def ended(ledger: Ledger, number: int, state: ItemState, recipe: str, twin: str | None = None) -> None:
    if twin is not None:
        ledger.identify(number, twin, "mesh")
    ledger.item_ended(number, state, recipe_sha256=recipe, reason="timeout", detail="verify failed 3 times: no answer")


def planned(place: object) -> list[tuple[str | None, str]]:
    document: dict[str, Any] = json.loads(manitwin("build", "-o", place, "--dry-run", "--quick", "--json"))
    check_keys(document, "build --dry-run")
    return [(item["kind"], item["state"]) for item in document["items"]]


def quick_recipe() -> str:
    return TwinRecipe(with_flags(BuildConfig(), {"quick": True})).sha256


def test_what_failed_is_not_said_to_be_built_until_it_is_opened_again(inputs: Path, tmp_path: Path) -> None:
    data, folder = tmp_path / "data", tmp_path / "inputs"
    ledger = Ledger(data / "ledger.sqlite")
    ledger.add_items(Item(file=str(folder / name)) for name in ("box.stl", "photo.png", "empty.png"))
    ended(ledger, 1, "failed", quick_recipe(), "5feceb66ffc86f38")
    ended(ledger, 2, "failed", "another recipe", "6b86b273ff34fce1")
    ended(ledger, 3, "failed", quick_recipe())  # before its bytes were read
    ledger.close()
    before = tree(tmp_path)
    assert planned(data) == [("mesh", "failed"), ("image", "to_build"), (None, "failed")]
    said = manitwin("build", "-o", data, "--dry-run", "--quick")
    assert "1 to build, 2 failed" in said and f"manitwin retry {data}" in said and "no answer" in said
    assert tree(tmp_path) == before

    manitwin("retry", data)
    assert [state for _, state in planned(data)] == ["to_build", "to_build", "would_be_rejected"]


def test_a_dry_run_sees_what_a_run_at_work_has_just_written(inputs: Path, tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "data/ledger.sqlite")
    ledger.add_items([Item(file=str(tmp_path / "inputs/box.stl"))])
    ended(ledger, 1, "failed", quick_recipe(), "5feceb66ffc86f38")
    ledger.commit()
    try:
        assert planned(tmp_path / "data") == [("mesh", "failed")], "it is in the write-ahead log alone"
    finally:
        ledger.close()


def test_of_a_url_the_ledger_of_this_machine_counts_and_its_copy_only_without_one(
    inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    root = DatasetRoot("memory://dry-run")
    box, recipe = Item(file=str(tmp_path / "inputs/box.stl")), quick_recipe()
    for place, state in ((tmp_path / "copy.sqlite", "open"), (ledger_path(root), "failed")):
        ledger = Ledger(place)
        ledger.add_items([box])
        if state == "failed":
            root.put_file(tmp_path / "copy.sqlite", LEDGER)
            ended(ledger, 1, "failed", recipe, "5feceb66ffc86f38")
        ledger.close()
    assert planned(root.url) == [("mesh", "failed")]
    shutil.rmtree(tmp_path / "state")
    assert planned(root.url) == [("mesh", "to_build")]
    assert not (tmp_path / "state").exists(), "nothing is written"


def test_what_services_charge_is_counted_for_what_would_be_built(inputs: Path, tmp_path: Path) -> None:
    (tmp_path / "paid.toml").write_text('generator = "hunyuan3d@http://localhost:1"\n[services]\nusd_per_job = 0.25\n')
    document = json.loads(
        manitwin("build", inputs, "-o", tmp_path / "out", "--config", tmp_path / "paid.toml", "--dry-run", "--json")
    )
    assert document["estimate"]["cost_usd"] == pytest.approx(0.25), "of one photo and one mesh"
    assert document["estimate"]["each"]["image"]["cost_usd"] == pytest.approx(0.25)


def test_wrong_use_is_wrong_use(tmp_path: Path) -> None:
    arguments = ["build", "--text", "a unicorn", "-o", str(tmp_path / "out"), "--dry-run"]
    with pytest.raises(UsageError, match="no template makes"):
        CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert not (tmp_path / "out").exists()


def test_measured_seconds_count_engines_and_grippers() -> None:
    quick = with_flags(BuildConfig(), {"quick": True})
    for kind, chain in CHAIN_CPU_S.items():
        assert measured_rate(quick, kind).cpu_s == chain
        whole = measured_rate(BuildConfig(), kind).cpu_s
        assert whole == pytest.approx(chain + SECOND_ENGINE_CPU_S + ROBUSTNESS_CPU_S + DOUBTS_CPU_S)
        two = measured_rate(quick.model_copy(update={"grippers": ("panda", "wsg50_110")}), kind).cpu_s
        assert two == pytest.approx(chain + TRIALS_CPU_S)
    assert measured_rate(quick, "photos", 3).cpu_s == CHAIN_CPU_S["image"] + 2 * FURTHER_PHOTO_CPU_S


def test_each_kind_of_input_has_its_own_cost_and_each_photo_of_a_thing_adds_to_it(tmp_path: Path) -> None:
    for number in range(5):
        pixels = np.full((64, 64, 3), 40 + 30 * number, np.uint8)
        Image.fromarray(pixels).save(tmp_path / f"{number}.png")
    rows = ["0.png,,a", "1.png,,a", "2.png,,b", "3.png,,b", "4.png,,b", ",a red mug,"]
    (tmp_path / "list.csv").write_text("file,text,group\n" + "\n".join(rows) + "\n")
    told = json.loads(
        manitwin("build", tmp_path / "list.csv", "-o", tmp_path / "out", "--dry-run", "--quick", "--json")
    )
    each = {kind: rate["cpu_seconds"] for kind, rate in told["estimate"]["each"].items()}
    assert each["photos"] == pytest.approx(CHAIN_CPU_S["image"] + 1.5 * FURTHER_PHOTO_CPU_S)
    assert told["estimate"]["cpu_seconds"] == pytest.approx(2 * each["photos"] + CHAIN_CPU_S["text"])


def test_a_data_set_that_has_built_enough_tells_its_own_rate(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "ledger.sqlite")
    ledger.add_items(Item(file=f"/{number}.obj") for number in range(1, 6))
    for number, recipe in ((1, "now"), (2, "now"), (3, "now"), (4, "before")):
        ledger.identify(number, f"{number:016x}", "mesh")
        for stage in ("mesh", "verify"):
            ledger.stage_ended(number, stage, "done", attempts=1, cpu_seconds=float(number))
        ledger.item_ended(number, "accepted", recipe_sha256=recipe, revision="r")
    rate = dataset_rate(ledger, "mesh", "now")
    assert rate is not None and rate.cpu_s == pytest.approx(2 * (1 + 2 + 3) / 3) and "3 accepted items" in rate.source
    assert dataset_rate(ledger, "mesh", "before") is None and dataset_rate(ledger, "image", "now") is None
    ledger.close()
