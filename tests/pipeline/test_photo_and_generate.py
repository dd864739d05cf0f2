"""From the project's own sample photo to a generated mesh, through both stages."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from kept_opinions import kept_opinions
from manitwin.config import GenerateConfig, MattingConfig
from manitwin.engine.stage import Draft
from manitwin.errors import InputError, Rejected, Unsupported
from manitwin.formats.glb import read_glb
from manitwin.models.generators.lift import LiftGenerator
from manitwin.models.matting.learned import find_networks
from manitwin.pipeline import photo
from manitwin.pipeline.generate import GenerateStage
from manitwin.pipeline.item import Item
from manitwin.pipeline.photo import PhotoStage
from manitwin.twin.import_record import ImportRecord
from tiny_networks import tiny_network

SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "bottle.jpg"


@pytest.fixture(scope="module", autouse=True)
def rules_and_the_built_in_network_asked_once() -> Iterator[None]:
    """Keep what they say of a picture: nearly all that is studied here is the sample."""
    with kept_opinions():
        yield


def _draft(**item: str | None) -> Draft:
    return Draft("t", Item(**{"file": None, **item}), seed=0)


def test_sample_photo_becomes_a_standing_bottle(tmp_path: Path) -> None:
    cut_out, generate = PhotoStage(MattingConfig()), GenerateStage(GenerateConfig(), LiftGenerator())
    assert cut_out.model is not None
    assert [model.split()[0] for model in cut_out.model.split(", ")] == ["object-network", "outline-network"]
    draft = _draft(file=str(SAMPLE))
    draft.fields.update(cut_out.run(draft, tmp_path))
    draft.paths["photo.png"] = tmp_path / "photo.png"
    fields = generate.run(draft, tmp_path)
    json.dumps({**draft.fields, **fields}, allow_nan=False)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["generated.glb", "photo.png"]
    assert draft.fields["matte"]["confidence"] > 0.8
    notes = fields["generation"]["notes"]
    assert (fields["generation"]["generator"], notes["primitive"], notes["rests"]) == ("lift", "revolution", "standing")
    rgba = np.asarray(Image.open(tmp_path / "photo.png"))
    shadow, bottle = rgba[420:430, 300:320, 3], rgba[250:270, 220:260, 3]
    assert rgba.shape == (640, 480, 4) and shadow.max() == 0 and bottle.min() == 255
    (part,) = read_glb(tmp_path / "generated.glb")
    # modelled: 0.2 m high, radius 0.0325 m, seen from 13 degrees above; the photo tells no size
    height = part.extents.max()
    assert part.extents / height == pytest.approx([0.325, 0.325, 1.0], abs=0.02)
    assert part.volume / height**3 == pytest.approx(np.pi / 4 * 0.325**2 * 0.80, rel=0.08)


def test_named_networks_are_recorded_where_they_were_asked(tmp_path: Path) -> None:
    """One is asked about every photo, two only about what is doubted without them."""
    names = []
    for name, share in (("a", 40.0), ("b", 41.0)):
        path = tmp_path / f"{name}.onnx"
        path.write_bytes(tiny_network(weights=(share, -30.0, -30.0)))
        names.append(str(path))
    one, two = find_networks(names[0]), find_networks(",".join(names))
    doubting = MattingConfig(min_confidence=1.0)
    for networks, settings, recorded in (
        (one, MattingConfig(), {"network"}),
        (two, MattingConfig(), set()),
        (two, doubting, {"network", "second_network"}),
    ):
        stage = PhotoStage(settings, networks)
        assert stage.model is not None and len(stage.model.split(", ")) == len(networks) + 2
        _, field = stage.cut_out(SAMPLE, None, lambda doubted: doubted.matte)
        assert {"network", "second_network"} & set(field) == recorded
        assert all(field[maker]["source"].endswith(".onnx") for maker in recorded)


def test_name_that_a_person_gave_speaks_for_a_doubtful_cut_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str | None] = []

    def check_of(name: str | None, focal_mm: float | None) -> Callable[[np.ndarray], bool] | None:
        asked.append(name)
        return None if name is None else lambda rgba: True

    monkeypatch.setattr(photo, "template_outline_check", check_of)
    doubting = PhotoStage(MattingConfig(min_confidence=0.985))
    with pytest.raises(Rejected, match="cannot be told from the background"):
        doubting.run(_draft(file=str(SAMPLE)), tmp_path)
    assert not list(tmp_path.iterdir())
    field = doubting.run(_draft(file=str(SAMPLE), name="bottle"), tmp_path)["matte"]
    assert asked == [None, "bottle"]
    assert field["confidence"] > 0.985
    assert any(finding.startswith("doubtful by itself") for finding in field["findings"])


def test_frame_of_an_animation_is_a_setting(tmp_path: Path) -> None:
    frames = [Image.new("RGB", (320, 240), (220, 220, 215)) for _ in range(2)]
    frames[1].paste((30, 60, 160), (110, 70, 210, 170))
    frames[0].save(tmp_path / "two.gif", save_all=True, append_images=frames[1:])
    draft = _draft(file=str(tmp_path / "two.gif"))
    with pytest.raises(InputError, match="animation"):
        PhotoStage(MattingConfig()).run(draft, tmp_path)
    fields = PhotoStage(MattingConfig(frame=1)).run(draft, tmp_path)
    assert "used frame 1 of 2" in fields["matte"]["findings"]


def test_text_without_a_template_needs_another_generator(tmp_path: Path) -> None:
    with pytest.raises(Unsupported, match="no template makes 'a red unicorn'"):
        GenerateStage(GenerateConfig(), LiftGenerator()).run(_draft(text="a red unicorn"), tmp_path)


def test_text_becomes_a_thing_of_known_size_mass_and_use(tmp_path: Path) -> None:
    made = GenerateStage(GenerateConfig(), LiftGenerator()).run(_draft(text="a red mug, 10 cm tall"), tmp_path)
    generation, (part, *_) = made["generation"], read_glb(tmp_path / "generated.glb")
    assert generation["model"] == "template:mug" and generation["metric"] and generation["rests"]
    assert part.visual.material.baseColorFactor[0] > 3 * part.visual.material.baseColorFactor[1]
    known = ImportRecord.model_validate(generation["known"])
    assert known.category == "mug" and known.source == "template:mug"
    assert known.mass_kg == pytest.approx(sum(generation["notes"]["masses_kg"].values()), rel=1e-4)
    assert [point.label for point in known.functional_points] == ["handle", "opening", "base"]
