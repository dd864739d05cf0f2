"""A plan chooses evenly of what a catalogue has, and asks for what is short."""

from __future__ import annotations

import csv
import json
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
from typer.testing import CliRunner

from json_documents import check_keys
from manitwin.cli.main import app
from manitwin.dataset.collect.facts import GROUPS, infer_facts, size_band_of
from manitwin.dataset.collect.plan_files import MANIFEST, PROMPTS, write_plan
from manitwin.dataset.collect.planning import INSIDE, plan_inputs, shares
from manitwin.dataset.collect.prompt_templates import SENTENCES, format_prompt
from manitwin.dataset.collect.store import Row
from manitwin.models.annotators.priors import load_priors
from manitwin.pipeline.manifest import Notes, iterate_items


def row(number: int, category: str = "mug", **changes: object) -> Row:
    said = infer_facts(category, None)
    made = Row(
        f"/inputs/{number}.obj", "mesh", "shop", "CC0-1.0", None, category, said.category, said.group, said.size_m,
        said.size_source, size_band_of(said.size_m), f"{number:064x}", 10, 1, "ready", None,
    )  # fmt: skip
    return replace(made, **changes)  # type: ignore[arg-type]


def collect(*words: object) -> list[str]:
    done = CliRunner().invoke(app, ["collect", *map(str, words)])
    assert done.exit_code == 0, done.output
    return done.stdout.splitlines()


def test_groups_get_equal_shares_and_their_sizes_and_categories_take_turns() -> None:
    rows = [
        row(100 * number + each, name) for number, name in enumerate(("mug", "spoon", "hammer")) for each in range(40)
    ]
    plan = plan_inputs(rows, 60)
    assert plan.wanted == dict.fromkeys(GROUPS, 10)
    assert plan.there == {**dict.fromkeys(GROUPS, 0), "kitchen": 10, "tools": 10}
    assert Counter(each.category for each in plan.chosen) == {"mug": 5, "spoon": 5, "hammer": 10}
    assert Counter(infer_facts(prompt.category, None).group for prompt in plan.prompts) == dict.fromkeys(GROUPS[2:], 10)
    assert plan.chosen == plan_inputs(rows[::-1], 60).chosen, "in whatever order they were added"
    assert plan.chosen != plan_inputs(rows, 60, seed=5).chosen
    assert shares(10, 6) == [2, 2, 2, 2, 1, 1]


def test_addresses_unknown_licences_categories_and_sizes_are_left_out_and_counted() -> None:
    rows = [
        row(1), row(2, licence="unknown"), row(3, "thingummy"), row(4, size_band="above 37 cm"), row(5, licence="X"),
        row(6, kind="url"),
    ]  # fmt: skip
    plan = plan_inputs(rows, 60)
    assert {each.place for each in plan.chosen} == {"/inputs/1.obj", "/inputs/5.obj"}
    assert plan.left_out == {
        "an address, which nothing is fetched from": 1,
        "size outside of 2 to 37 cm": 1,
        "unknown category": 1,
        "unknown licence": 1,
    }
    only = plan_inputs(rows, 60, licenses=["CC0-1.0"])
    assert [each.place for each in only.chosen] == ["/inputs/1.obj"]
    assert plan_inputs(rows, 60, licenses=["cc0-1.0", "MIT"]).chosen == only.chosen
    assert only.left_out["licence not among those allowed"] == 2


def test_every_group_has_categories_of_sizes_that_the_paper_keeps() -> None:
    said = [infer_facts(name, None) for name in load_priors()]
    assert {each.group for each in said if size_band_of(each.size_m) in INSIDE} >= set(GROUPS)


def test_prompts_name_their_category_and_differ() -> None:
    prompts = plan_inputs([], 6 * 500).prompts
    assert len(prompts) == 3000 and len({prompt.text for prompt in prompts}) > 2000
    assert all(prompt.category in prompt.text for prompt in prompts)
    assert {prompt.category for prompt in prompts} <= set(load_priors()) - {"unknown"}
    assert len(set(SENTENCES)) == 15 and not any(re.search(r"\ba [aeiou]", prompt.text) for prompt in prompts)


def test_a_prompt_asks_for_a_pair_of_what_comes_in_pairs() -> None:
    scissors = load_priors()["scissors"]
    said = [format_prompt(scissors, number, np.random.default_rng(number)) for number in range(len(SENTENCES))]
    assert said[0] == "a pair of scissors" and all("pair of scissors" in each for each in said)


def test_a_plan_is_two_manifests_that_a_build_reads(tmp_path: Path) -> None:
    catalogue, out = tmp_path / "c.db", tmp_path / "plan"
    for name in ("mug.stl", "spoon.stl"):
        (tmp_path / name).write_bytes(name.encode())
    (tmp_path / "list.csv").write_text("file,name,license\nmug.stl,mug,CC0-1.0\nspoon.stl,spoon,CC-BY-4.0\n")
    collect("add", catalogue, tmp_path / "list.csv", "--source", "shop")
    told = collect("plan", catalogue, "--items", 12, "-o", out)
    assert told[0] == "kitchen: 2 of 2" and told[-1].endswith(f"{PROMPTS}: 10 texts")
    items = list(iterate_items([out / MANIFEST], {}, Notes(), strict=True))
    assert {(Path(item.file or "").name, item.name, item.license) for item in items} == {
        ("mug.stl", "mug", "CC0-1.0"), ("spoon.stl", "spoon", "CC-BY-4.0")
    }  # fmt: skip
    texts = list(iterate_items([out / PROMPTS], {}, Notes(), strict=True))
    assert len(texts) == 10 and all(item.text and item.name for item in texts)
    first = {path.name: path.read_bytes() for path in out.iterdir()}
    collect("plan", catalogue, "--items", 12, "-o", out)
    assert first == {path.name: path.read_bytes() for path in out.iterdir()}
    said = json.loads("\n".join(collect("plan", catalogue, "--items", 12, "-o", out, "--json")))
    check_keys(said, "collect plan")
    assert said == json.loads((out / "plan.json").read_text())


def test_masks_beside_photos_are_in_the_plan(tmp_path: Path) -> None:
    photos, out = tmp_path / "photos", tmp_path / "plan"
    photos.mkdir()
    for name in ("mug.jpg", "mug_mask.png", "spoon.jpg"):
        (photos / name).write_bytes(name.encode())
    collect("add", tmp_path / "c.db", photos, "--source", "mine", "--licence", "CC0-1.0")
    collect("plan", tmp_path / "c.db", "--items", 12, "-o", out)
    items = list(iterate_items([out / MANIFEST], {}, Notes(), strict=True))
    masks = {Path(item.file or "").name: item.masks for item in items}
    assert masks == {"mug.jpg": (str(photos / "mug_mask.png"),), "spoon.jpg": ()}


def test_a_plan_of_nothing_is_all_prompts(tmp_path: Path) -> None:
    write_plan(plan_inputs([], 7), tmp_path / "plan")
    with (tmp_path / "plan" / PROMPTS).open() as stream:
        assert len(list(csv.DictReader(stream))) == 7
