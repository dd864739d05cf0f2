"""The second engine's model of a hand and a body is compiled once for all grasps of the body that are tried one by one."""

from __future__ import annotations

import gc
from dataclasses import replace

import pytest

from manitwin.physics.mujoco import hand_scene
from manitwin.physics.mujoco import trial as mujoco_trial
from manitwin.physics.mujoco.trial import MujocoTrial
from rigid_boxes import PANDA, SETTINGS, above, box


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The mass of each body that a model was compiled of."""
    masses_kg: list[float] = []
    compile_model = hand_scene.hand_model

    def counted(*given: object) -> object:
        masses_kg.append(given[0].mass_kg)  # type: ignore[attr-defined]
        return compile_model(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(hand_scene, "hand_model", counted)
    return masses_kg


def test_a_body_is_compiled_once_and_again_for_other_settings_with_the_same_results(compiled: list[float]) -> None:
    brick, trial, grasp = box([0.04, 0.1, 0.04], 0.5), MujocoTrial(), above([0, 0, 0])[None]
    weaker = replace(SETTINGS, force_n=SETTINGS.force_n / 2)
    first = trial.run(brick, PANDA, grasp, SETTINGS)
    assert trial.run(brick, PANDA, grasp, SETTINGS) == first
    assert len(compiled) == 1
    trial.run(brick, PANDA, grasp, weaker)
    assert len(compiled) == 2
    assert trial.run(box([0.04, 0.1, 0.04], 0.5), PANDA, grasp, SETTINGS) == first
    assert len(compiled) == 3


def test_a_model_goes_with_its_body(compiled: list[float]) -> None:
    brick = box([0.04, 0.1, 0.04], 0.6)
    MujocoTrial().run(brick, PANDA, above([0, 0, 0])[None], SETTINGS)
    held = mujoco_trial._MODELS._by_body
    assert id(brick) in held
    number = id(brick)
    del brick
    gc.collect()
    assert number not in held
