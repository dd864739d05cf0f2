"""A thing that nobody has named gets a classifier's name, which every later stage goes by; a person's word overrules it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from manitwin.config import BuildConfig, NamingConfig
from manitwin.engine.stage import Draft
from manitwin.pipeline.guesses import naming_checks, shape_checks, template_checks
from manitwin.pipeline.item import Item
from manitwin.pipeline.naming import NameStage, cut_view, known_length_m
from manitwin.pipeline.object_state import object_name
from manitwin.pipeline.recipe import stages_for
from manitwin.render.renderer import BACKDROP
from manitwin.twin.record import Naming

SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "bottle.jpg"
SURE = {"name": "orange", "probability": {"value": 0.9, "low": 0.8, "high": 0.95, "source": "efficientnet-lite0"}}
SURE["likeliest"] = [{"name": "orange", "probability": 0.9}, {"name": "lemon", "probability": 0.05}]


def draft(folder: Path, name: str | None = None) -> Draft[Item]:
    made = Draft("t", Item(file=str(SAMPLE), name=name), seed=0)
    Image.open(SAMPLE).convert("RGBA").save(folder / "photo.png")
    made.paths["photo.png"] = folder / "photo.png"
    return made


def test_a_photo_without_a_name_is_looked_at_and_one_with_a_name_is_not(tmp_path: Path) -> None:
    naming = NameStage(NamingConfig()).run(draft(tmp_path), tmp_path)["naming"]
    json.dumps(naming, allow_nan=False)
    record = Naming.model_validate(naming)
    assert record.probability.source == "efficientnet-lite0" and len(record.likeliest) == 3
    assert NameStage(NamingConfig()).run(draft(tmp_path, "mug"), tmp_path) == {"naming": None}
    assert NameStage(NamingConfig(enabled=False)).run(draft(tmp_path), tmp_path) == {"naming": None}


def test_the_classifiers_name_counts_after_a_persons_and_a_generators(tmp_path: Path) -> None:
    made = draft(tmp_path)
    made.fields["naming"] = SURE
    assert object_name(made) == "orange"
    made.fields["naming"] = SURE | {"name": None}
    assert object_name(made) is None
    made.fields |= {"naming": SURE, "generation": {"known": {"name": "mug"}}}
    assert object_name(made) == "mug"
    assert object_name(Draft("t", Item(file=str(SAMPLE), name="my cup"), seed=0, fields=made.fields)) == "my cup"


def test_every_stage_that_goes_by_the_name_reads_it() -> None:
    for kind in ("image", "mesh"):
        stages = stages_for(kind, BuildConfig())
        names = [stage.name for stage in stages]
        assert names.index("name") == (1 if kind == "image" else names.index("gate") - 1)
        asked = {"generate", "mesh", "gate", "physical", "caption", "points", "parts", "finish"}
        assert {s.name for s in stages if "naming?" in s.reads} == asked & set(names)
    assert "name" not in [stage.name for stage in stages_for("text", BuildConfig())]


def test_the_finding_names_the_likeliest_and_the_remedy(tmp_path: Path) -> None:
    made = draft(tmp_path)
    assert naming_checks(made) == []
    made.fields["naming"] = SURE
    (sure,) = naming_checks(made)
    assert sure.passed and "orange 90 %, lemon 5 %" in sure.message and "--name" in sure.message
    made.fields["naming"] = SURE | {"name": None}
    (unsure,) = naming_checks(made)
    filled = {"source": "vlm:eyes-1", "category": "mug", "findings": ["width 9, but ..."]}
    made.fields["generation"] = {"known": {"name": "mug"}, "notes": {"filled": filled}}
    (told,) = naming_checks(made)
    assert told.passed and told.message == "vlm:eyes-1 takes it for a mug; --name overrules it"
    (marked,) = template_checks(made)
    assert not marked.passed and marked.message == "vlm:eyes-1 filled in the template mug; width 9, but ..."
    assert unsure.passed is False and "cannot tell what it is (orange 90 %" in unsure.message


def test_words_of_a_text_that_say_nothing_to_its_template_are_a_finding() -> None:
    notes = {"unused_words": ["vintage"]}
    made = Draft("t", Item(file=None, text="a vintage mug"), seed=0, fields={"generation": {"notes": notes}})
    (told,) = template_checks(made)
    assert told.passed is False and told.message is not None and "'vintage'" in told.message
    notes["unused_words"] = []
    assert template_checks(made) == []


def test_an_outline_that_no_template_of_the_name_has_is_a_finding() -> None:
    poor = {"category": "yogurt cup", "confidence": 0.007, "residual": {"iou": 0.8685, "outline": 0.016}}
    made = Draft("t", Item("photo.jpg", name="yoghurt"), seed=0, fields={"generation": {"notes": {"poor_fit": poor}}})
    (told,) = shape_checks(made)
    assert told.passed is False and told.value == 0.8685
    assert (
        told.message is not None
        and "no yogurt cup that the template makes has this outline (overlap 0.87)" in told.message
    )
    made.fields["generation"] = {"notes": {"primitive": "template:yogurt cup"}}
    assert shape_checks(made) == [] and shape_checks(Draft("t", Item("mug.glb"), seed=0)) == []


@pytest.mark.parametrize(
    ("metric", "units", "known"),
    [(True, "assumed", True), (True, "user", True), (True, "guessed", False), (False, "assumed", False)],
)
def test_a_mesh_is_as_long_as_it_stands_where_its_unit_is_known(
    tmp_path: Path, metric: bool, units: str, known: bool
) -> None:
    made = Draft("t", Item(file=str(SAMPLE)), seed=0, fields={"geometry": {"metric": metric, "units": units}})
    assert known_length_m(made) is None, "a photo has no size"
    np.savez(tmp_path / "canonical.npz", vertices=np.array([[0, 0, 0], [0.03, 0, 0], [0, 0, 0.2], [0, 0.01, 0.1]]))
    made.paths["canonical.npz"] = tmp_path / "canonical.npz"
    length_m = known_length_m(made)
    assert (length_m == pytest.approx(0.2)) if known else (length_m is None)


def test_a_view_is_cut_out_of_its_backdrop() -> None:
    view = np.full((40, 40, 3), BACKDROP, np.uint8)
    view[10:20, 5:30] = (20, 30, 40)
    alpha = cut_view(view)[..., 3]
    assert alpha[10:20, 5:30].min() == 255 and alpha.astype(float).sum() == 250 * 255
    assert cut_view(np.full((4, 4, 3), BACKDROP, np.uint8))[..., 3].min() == 255
