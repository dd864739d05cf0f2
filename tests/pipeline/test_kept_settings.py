"""The settings that a data set was built with hold for later builds, and those that are no defaults now are named."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from manitwin.config import BuildConfig
from manitwin.pipeline.settings import BuildRequest, request_build


def requested(place: Path, config: BuildConfig | None = None) -> BuildRequest:
    return request_build(
        [], place, texts=["a mug"], strict=False, jobs=None, config=config, defaults={}, flags={}
    )  # fmt: skip


def built_with(place: Path, **changed: dict[str, Any]) -> Path:
    """Leave the configuration that an earlier version with other defaults would have left."""
    said = BuildConfig().model_dump(mode="json")
    for section, values in changed.items():
        said[section] |= values
    place.mkdir()
    (place / "config.json").write_text(json.dumps(said))
    return place


def test_what_was_a_default_of_an_earlier_version_holds_and_is_named(tmp_path: Path) -> None:
    place = built_with(tmp_path / "data", matting={"min_confidence": 0.25}, second_opinion={"enabled": False})
    request = requested(place)
    assert request.settings.matting.min_confidence == 0.25
    (said,) = request.notes.remarks
    assert "(not this version's defaults: matting.min_confidence 0.25, second_opinion.enabled false)" in said
    assert "--config and options change them" in said
    assert requested(place, BuildConfig()).notes.remarks == []


@pytest.mark.parametrize("section", ["run", "services"])
def test_what_decides_no_twin_is_not_named(section: str, tmp_path: Path) -> None:
    value = {"cpu": 3} if section == "run" else {"max_cost_usd": 2.0}
    (said,) = requested(built_with(tmp_path / "data", **{section: value})).notes.remarks
    assert "defaults" not in said


def test_of_many_the_first_are_named_and_the_others_counted(tmp_path: Path) -> None:
    counts = {"simulated": 7, "unfiltered": 7, "rounds": 7, "scarce_rounds": 7, "near_enough": 7, "max_proposals": 77}
    place = built_with(tmp_path / "data", grasps=counts, candidates={"samples": 5000}, views={"webp_quality": 77})
    (said,) = requested(place).notes.remarks
    assert "candidates.samples 5000" in said and " and 2 more)" in said
