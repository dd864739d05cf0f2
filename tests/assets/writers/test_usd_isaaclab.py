"""The Isaac Lab module, run against stand-ins for the two names of Isaac Lab that it uses: Isaac Sim cannot run here."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from pxr import Usd, UsdPhysics

from exported_twins import MASS_KG, NAME, content
from manitwin.assets.writers import isaaclab
from manitwin.assets.writers.exporter import TwinContent


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> TwinContent:
    return content(tmp_path_factory.mktemp("isaaclab") / "twin")


def run_module(twin: TwinContent, folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Write the export, import its module, and return the arguments that its configuration was made with."""
    exported = isaaclab.export(twin)
    for name, data in exported.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    sim, assets = ModuleType("isaaclab.sim"), ModuleType("isaaclab.assets")
    sim.UsdFileCfg = lambda **given: given  # type: ignore[attr-defined]
    assets.RigidObjectCfg = lambda **given: given  # type: ignore[attr-defined]
    package = ModuleType("isaaclab")
    package.sim, package.assets = sim, assets  # type: ignore[attr-defined]
    for module in (package, sim, assets):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    names: dict[str, Any] = {"__file__": str(folder / exported.main)}
    exec(compile((folder / exported.main).read_text(), exported.main, "exec"), names)
    found: dict[str, Any] = names[f"{NAME.upper()}_CFG"]
    return found


def test_configuration_spawns_the_stage_and_overrides_nothing(
    twin: TwinContent, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    configuration = run_module(twin, tmp_path, monkeypatch)
    assert configuration.keys() == {"prim_path", "spawn"}
    assert configuration["spawn"].keys() == {"usd_path"}
    stage = Usd.Stage.Open(configuration["spawn"]["usd_path"])
    mass = UsdPhysics.MassAPI(stage.GetDefaultPrim()).GetMassAttr().Get()
    assert mass == pytest.approx(MASS_KG, rel=1e-6)


def test_attribution_cannot_write_code(twin: TwinContent, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hostile = 'Ada\n"""\nraise SystemExit\r\u2028\0'
    source = twin.record.source.model_copy(update={"attribution": hostile, "license": hostile, "file": hostile})
    record = twin.record.model_copy(update={"source": source})
    assert run_module(replace(twin, record=record), tmp_path, monkeypatch)["spawn"]


def test_export_says_that_it_was_not_run(twin: TwinContent) -> None:
    assert any("has not been run in Isaac Lab" in line for line in isaaclab.export(twin).cannot_say)
