"""Wrong arguments of a build: said before any work is begun, and nothing is left behind."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import manitwin
from manitwin.config import BuildConfig, SecondOpinionConfig
from manitwin.errors import UsageError
from manitwin.robots import grippers

PANDA_FILE = Path(grippers.__file__).parent / "definitions" / "panda.toml"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"grippers": ["pandas"]}, "did you mean 'panda'"),
        ({"grippers": ["panda", "hook.toml"]}, "hook.toml does not exist"),
        ({"grippers": ["panda", str(PANDA_FILE)]}, "grippers panda, panda: .*names must be unique; name panda once"),
        ({"quick": True, "require_agreement": True}, "--quick skips the second engine"),
        ({"grippers": ["panda", "suction"], "require_agreement": True}, "no second engine can try the gripper suction"),
        (
            {"config": BuildConfig(second_opinion=SecondOpinionConfig(enabled=False, require_agreement=True))},
            "requires agreement and is not enabled",
        ),
        ({"config": BuildConfig(second_simulator="mujocco")}, "did you mean 'mujoco'"),
        ({"config": BuildConfig(simulator="sapient")}, "did you mean 'sapien'"),
        ({"jobs": 0}, "jobs is 0"),
    ],
)
def test_wrong_argument_is_a_usage_error_before_any_work(
    tmp_path: Path, arguments: dict[str, Any], message: str
) -> None:
    (tmp_path / "cup.stl").write_bytes(b"x")
    with pytest.raises(UsageError, match=message):
        manitwin.build(tmp_path / "cup.stl", tmp_path / "out", **arguments)
    assert not (tmp_path / "out").exists()
