"""Why a twin that is there would be built again: its record against this configuration and the stages as they are."""

from __future__ import annotations

from typing import Any

import pytest

from manitwin.config import BuildConfig
from manitwin.pipeline.recipe import config_sha256, describe_differences, is_current, stages_for
from manitwin.twin.record import TwinRecord

CONFIG = BuildConfig()


@pytest.fixture(scope="module")
def now() -> dict[str, dict[str, Any]]:
    """The provenance of a mesh's stages as they are now."""
    return {
        stage.name: {"version": stage.version, "backend": stage.backend, "model": stage.model}
        for stage in stages_for("mesh", CONFIG)
    }


def record_of(stages: dict[str, dict[str, Any]], **provenance: Any) -> TwinRecord:
    """Return the record of a mesh that was rejected in the last of these stages."""
    made = {"manitwin_version": "0", "config_sha256": config_sha256(CONFIG), "seed": CONFIG.seed, "stages": stages}
    said = {
        "twin_id": "abc",
        "revision": "0",
        "name": None,
        "status": "rejected",
        "rejection": {"stage": "gate", "reason": "degenerate", "detail": "nothing in it"},
        "source": {"kind": "mesh", "file": "source.obj", "sha256": "0", "license": "unknown"},
        "provenance": {**made, **provenance},
        "quality": {"checks": []},
        "files": {},
    }
    return TwinRecord.model_validate(said)


def test_what_is_as_it_would_be_made_now_is_current(now: dict[str, dict[str, Any]]) -> None:
    record = record_of({name: now[name] for name in ("mesh", "views", "gate")})
    assert is_current(record, CONFIG) and describe_differences(record, CONFIG) == ""


def test_stages_of_an_earlier_version_are_named_in_their_order(now: dict[str, dict[str, Any]]) -> None:
    earlier = {name: {**now[name], "version": "0"} for name in ("mesh", "gate")}
    record = record_of({**earlier, "views": now["views"]})
    assert not is_current(record, CONFIG)
    assert describe_differences(record, CONFIG) == "by other versions of mesh, gate"


def test_of_many_stages_the_first_are_named(now: dict[str, dict[str, Any]]) -> None:
    record = record_of({name: {**stage, "version": "0"} for name, stage in now.items()})
    assert (
        describe_differences(record, CONFIG)
        == f"by other versions of name, mesh, views, gate and {len(now) - 4} more stages"
    )


def test_a_stage_that_is_no_more_is_another_one(now: dict[str, dict[str, Any]]) -> None:
    record = record_of({"mesh": now["mesh"], "unwrap": {"version": "1", "backend": "rules", "model": None}})
    assert describe_differences(record, CONFIG) == "by other versions of unwrap"


def test_seed_and_settings_are_told(now: dict[str, dict[str, Any]]) -> None:
    record = record_of({"mesh": now["mesh"]}, seed=7, config_sha256="0")
    assert describe_differences(record, CONFIG) == "with another seed and with other settings"
