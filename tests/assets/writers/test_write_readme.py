"""README.md of an export: its code runs as it stands, and its numbers are the twin's."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import exported_twins as made
from manitwin.assets.writers.write import export_twin


def code_of(folder: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", (folder / "README.md").read_text(), re.DOTALL)


def run(code: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    monkeypatch.chdir(folder)
    names: dict[str, Any] = {}
    exec(code, names)
    return names


@pytest.fixture
def out(tmp_path: Path) -> Path:
    twin = made.content(tmp_path / "twin")
    for name in ("mjcf", "urdf", "sdf", "glb"):
        export_twin(twin, name, tmp_path / "out")
    return tmp_path / "out" / made.NAME


def test_the_code_for_mujoco_runs(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    alone, attached = (run(code, out / "mjcf", monkeypatch)["model"] for code in code_of(out / "mjcf"))
    assert alone.body_mass[1] == attached.body_mass[1] == pytest.approx(made.MASS_KG)


def test_the_code_for_pybullet_runs(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pybullet = pytest.importorskip("pybullet", reason="pybullet has no wheels for this Python")
    try:
        body = run(code_of(out / "urdf")[0], out / "urdf", monkeypatch)["body"]
        assert pybullet.getDynamicsInfo(body, -1)[0] == pytest.approx(made.MASS_KG)
        pybullet.disconnect()
        [body] = run(code_of(out / "sdf")[0], out / "sdf", monkeypatch)["bodies"]
        assert pybullet.getDynamicsInfo(body, -1)[0] == pytest.approx(made.MASS_KG)
    finally:
        pybullet.disconnect()


def test_the_code_for_sapien_runs(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sapien

    body = run(code_of(out / "urdf")[1], out / "urdf", monkeypatch)["body"]
    component = body.find_component_by_type(sapien.physx.PhysxRigidDynamicComponent)
    assert component.mass == pytest.approx(made.MASS_KG)
    material = component.collision_shapes[0].physical_material
    given = (material.static_friction, material.dynamic_friction, material.restitution)
    assert given == pytest.approx((made.STATIC, made.DYNAMIC, made.RESTITUTION))


def test_the_code_for_glb_runs(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = run(code_of(out / "glb")[0], out / "glb", monkeypatch)
    assert len(names["visual"].geometry) == len(names["hulls"].geometry) == 3


def test_numbers_licence_and_what_is_missing_are_told(out: Path) -> None:
    text = (out / "urdf" / "README.md").read_text()
    assert "0.37 (0.296 to 0.444, prior:hammer) kg" in text
    assert "principal moments 0.00021, 0.00047, 0.00059 kg m²" in text
    assert "friction and restitution: URDF has none" in text
    assert "CC-BY-4.0; attribution: Ada Lovelace" in text
