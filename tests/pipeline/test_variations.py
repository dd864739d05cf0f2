"""``--count`` makes several things of one text: other measures and colours, ids of their own, the same ones every time."""

from __future__ import annotations

from pathlib import Path

import pytest

from manitwin.config import GenerateConfig
from manitwin.engine.stage import Draft
from manitwin.errors import UsageError
from manitwin.models.generators.lift import LiftGenerator
from manitwin.pipeline.generate import GenerateStage, generator_seed
from manitwin.pipeline.item import Item, twin_id
from manitwin.pipeline.manifest import Notes, iterate_items
from manitwin.pipeline.settings import request_build

SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "bottle.jpg"


def variations(count: int) -> list[Item]:
    return list(iterate_items([], {}, Notes(), ["a red mug, 9 cm tall"], count=count))


def made(item: Item, folder: Path, seed: int = 0) -> dict[str, object]:
    folder.mkdir(parents=True)
    stage = GenerateStage(GenerateConfig(), LiftGenerator())
    notes = stage.run(Draft("t", item, seed=seed), folder)["generation"]["notes"]
    return {"measures": notes["measures"], "glb": (folder / "generated.glb").read_bytes()}


def test_variations_have_ids_of_their_own_and_the_first_is_what_the_text_alone_makes() -> None:
    items = variations(20)
    assert len({twin_id(item) for item in items}) == len({item.title for item in items}) == 20
    assert items[0] == variations(1)[0] and "variation" not in items[0].to_json()
    assert [Item.from_json(item.to_json()) for item in items] == items


def test_variations_differ_where_the_text_leaves_it_open_and_repeat_byte_for_byte(tmp_path: Path) -> None:
    first, second = variations(2)
    one, two, again = (made(item, tmp_path / str(n)) for n, item in enumerate((first, second, second)))
    assert one["measures"] != two["measures"] and two == again
    stated = [things["measures"]["height_m"] for things in (one, two)]  # type: ignore[index]
    assert stated == pytest.approx([0.09, 0.09], abs=2e-3), "what the text says holds for all"


def test_the_variations_of_neighbouring_seeds_are_not_the_same_things() -> None:
    seeds = [
        generator_seed(Draft("t", Item(file=None, text="a mug", variation=variation), seed=seed))
        for seed in range(50)
        for variation in range(50)
    ]
    assert len(set(seeds)) == 2500 and max(seeds) < 2**31


def test_files_have_no_variations_and_a_count_has_limits(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"bottle\.jpg: --count applies to texts"):
        list(iterate_items([SAMPLE], {}, Notes(), count=2))
    for count in (0, 100_001):
        with pytest.raises(UsageError, match=f"count is {count}; give 1 to 100000"):
            request_build(
                [],
                tmp_path / "new",
                texts=["a mug"],
                count=count,
                strict=False,
                jobs=None,
                config=None,
                defaults={},
                flags={},
            )
