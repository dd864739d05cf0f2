"""The project's own samples through the whole command, checked against things that the command did not compute."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import mujoco
import numpy as np
import pytest
import sapien
import trimesh
from sapien import physx

import manitwin
from manitwin.config import BuildConfig
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.record_values import Check

SAMPLES = Path(__file__).resolve().parent.parent / "samples"
QUICK = BuildConfig(
    grasps={"simulated": 16, "unfiltered": 4}, second_opinion={"enabled": False}, robustness={"enabled": False}
)
THOROUGH = BuildConfig(
    grasps={"simulated": 16, "unfiltered": 4}, second_opinion={"jittered": 6}, robustness={"max_trials": 3}
)


@pytest.fixture(scope="session")
def samples(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Twin]:
    """The twins of the project's sample photo and sample mesh, by the kind of their source."""
    out = tmp_path_factory.mktemp("samples")
    report = manitwin.build(SAMPLES / "samples.csv", out, config=QUICK, jobs=1)  # tests run side by side as it is
    assert report.exit_code == 0, [r.detail for r in report.results]
    twins = [manitwin.load(r.folder, verify=True) for r in report.results if r.folder]
    return {twin.record.source.kind: twin for twin in twins}


def test_samples_are_accepted_from_photo_and_mesh(samples: dict[str, Twin]) -> None:
    assert set(samples) == {"image", "mesh"}
    for twin in samples.values():
        assert twin.record.status == "accepted"
        assert twin.record.grasps is not None and twin.record.grasps.verified >= 1
        assert (twin.folder / "card.png").stat().st_size > 50_000


def test_generated_twin_says_who_made_it(samples: dict[str, Twin]) -> None:
    stages = samples["image"].record.provenance.stages
    assert stages["generate"].backend == "lift"
    assert "generate" not in samples["mesh"].record.provenance.stages


def test_lifted_twin_says_what_its_photo_does_not_show(samples: dict[str, Twin]) -> None:
    found = {kind: [c for c in _checks(twin) if c.name == "every_side_seen"] for kind, twin in samples.items()}
    (check,) = found["image"]
    assert check.passed is False and check.value == pytest.approx(0.5, abs=0.15) and "a guess" in check.message
    assert found["mesh"] == []


def _checks(twin: Twin) -> list[Check]:
    assert twin.record.quality is not None
    return twin.record.quality.checks


@pytest.mark.parametrize("kind", [pytest.param("image", marks=pytest.mark.slow), "mesh"])
def test_same_input_and_seed_give_the_same_twin(samples: dict[str, Twin], kind: str, tmp_path: Path) -> None:
    twin = samples[kind]
    source = twin.folder / twin.record.source.file
    report = manitwin.build(source, tmp_path, name=twin.record.name, config=QUICK, **_said(kind))
    again = manitwin.load(report.results[0].folder or "", verify=True)
    assert again.record.files == twin.record.files
    assert again.record.revision == twin.record.revision


def _said(kind: str) -> dict[str, str]:
    with (SAMPLES / "samples.csv").open() as stream:
        header, *rows = (line.strip().split(",") for line in stream)
    row = next(dict(zip(header, r, strict=True)) for r in rows if r[0].endswith((".glb",)) == (kind == "mesh"))
    return {key: row[key] for key in ("license", "attribution", "units") if row.get(key)}


def test_finished_twins_are_not_built_again(samples: dict[str, Twin]) -> None:
    out = samples["mesh"].folder.parents[2]
    started = time.process_time()
    report = manitwin.build(SAMPLES / "samples.csv", out, config=QUICK)
    assert all(result.reused for result in report.results)
    assert time.process_time() - started < 5


def test_changed_setting_runs_its_stage_and_what_follows_only(samples: dict[str, Twin], tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(samples["mesh"].folder.parents[2], out)
    config = QUICK.model_copy(update={"placement": QUICK.placement.model_copy(update={"max_placements": 1})})
    report = manitwin.build(SAMPLES / "mug.glb", out, name="mug", config=config, **_said("mesh"))
    assert report.results[0].status == "accepted"
    work = out / ".work" / report.results[0].twin_id
    runs = {folder.name: len(list(folder.iterdir())) for folder in work.iterdir() if folder.is_dir()}
    assert runs["placement"] == runs["finish"] == 2
    assert runs["mesh"] == runs["points"] == runs["collision"] == 1


def test_mass_properties_agree_with_mujoco(samples: dict[str, Twin]) -> None:
    # MuJoCo integrates the closed visual mesh by itself, from the twin's mass
    twin = samples["mesh"]
    physical = twin.physical
    assert physical.mass_distribution == "solid"
    mesh = trimesh.util.concatenate([trimesh.Trimesh(part.vertices, part.faces) for part in twin.visual])
    vertices = " ".join(f"{x:.9f}" for x in np.asarray(mesh.vertices).ravel())
    faces = " ".join(str(i) for i in np.asarray(mesh.faces).ravel())
    xml = f"""<mujoco><compiler balanceinertia="false"/>
    <asset><mesh name="m" vertex="{vertices}" face="{faces}" inertia="exact"/></asset>
    <worldbody><body><freejoint/><geom type="mesh" mesh="m" mass="{physical.mass_kg.value}"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    assert np.sort(model.body_inertia[1]) == pytest.approx(
        np.linalg.eigvalsh(np.array(physical.inertia_kg_m2)), rel=0.01
    )
    assert model.body_ipos[1] == pytest.approx(physical.center_of_mass_m, abs=5e-4)


def test_twin_stands_where_sapien_is_told_to_put_it(samples: dict[str, Twin]) -> None:
    for twin in samples.values():
        scene = sapien.Scene([physx.PhysxCpuSystem()])
        scene.add_ground(0.0, render=False)
        body = twin.add_to_sapien(scene, sapien.Pose([0.1, 0.2, 0.001]), visual=False)
        component = body.find_component_by_type(physx.PhysxRigidDynamicComponent)
        assert component.mass == pytest.approx(twin.physical.mass_kg.value, rel=1e-5)
        for _ in range(200):
            scene.step()
        if any(p.upright and p.settled for p in twin.record.placements or []):
            assert body.pose.p == pytest.approx([0.1, 0.2, 0.0], abs=0.01)


def test_grasps_load_as_arrays(samples: dict[str, Twin]) -> None:
    twin = samples["mesh"]
    assert twin.record.grasps is not None
    verified, tried = twin.grasps(), twin.grasps(verified_only=False)
    assert len(verified) == twin.record.grasps.verified and len(tried) == twin.record.grasps.simulated
    rotation = tried.gripper_to_object[:, :3, :3]
    assert np.allclose(rotation @ np.swapaxes(rotation, 1, 2), np.eye(3), atol=1e-9)
    assert set(verified.outcome) == {"held"}


@pytest.fixture(scope="session")
def thorough(samples: dict[str, Twin], tmp_path_factory: pytest.TempPathFactory) -> Twin:
    """The sample mug with both engines, robustness and a second gripper, from the stages that the quick one has run."""
    out = tmp_path_factory.mktemp("thorough")
    work = Path(".work") / samples["mesh"].record.twin_id
    shutil.copytree(samples["mesh"].folder.parents[2] / work, out / work)
    grippers = ("panda", "wsg50_110")
    report = manitwin.build(SAMPLES / "mug.glb", out, name="mug", config=THOROUGH, grippers=grippers, **_said("mesh"))
    assert report.exit_code == 0, [r.detail for r in report.results]
    return manitwin.load(report.results[0].folder or "", verify=True)


def test_thorough_build_asks_a_second_engine_and_tries_held_grasps_again(
    thorough: Twin, samples: dict[str, Twin]
) -> None:
    summary, quick = thorough.record.grasps, samples["mesh"].record.grasps
    assert summary is not None and quick is not None
    assert (quick.second_opinion, quick.robustness, quick.other_grippers) == (None, None, {})
    left_out = {"second_opinion": None, "robustness": None, "other_grippers": {}}
    assert summary.model_copy(update=left_out) == quick, "nothing else changes"
    second, robustness = summary.second_opinion, summary.robustness
    assert second is not None and robustness is not None
    assert second.engine == "mujoco" and second.held_tried == summary.verified
    assert second.holds_share is not None and second.holds_share >= 0.9
    assert second.jittered == 6
    assert robustness.max_trials == 3
    assert 2 * summary.verified <= robustness.trials <= 3 * summary.verified
    mass = thorough.physical.mass_kg
    assert robustness.mass_kg == (mass.low, mass.high)
    stages = thorough.record.provenance.stages
    assert {"second_opinion", "robustness", "verify-wsg50_110", "robustness-wsg50_110"} <= set(stages)
    assert stages["second_opinion"].backend == "mujoco"
    assert not {"second_opinion", "robustness"} & set(samples["mesh"].record.provenance.stages)


def test_thorough_grasps_are_ranked_and_controls_are_left_out(thorough: Twin) -> None:
    assert thorough.record.grasps is not None
    grasps = thorough.grasps()
    assert len(grasps) == thorough.record.grasps.verified
    assert not any(":" in proposer for proposer in grasps.columns["proposer"])
    held = np.round(np.array(grasps.columns["robustness"]) * np.array(grasps.columns["robustness_trials"]))
    rank = (held + 1) / (np.array(grasps.columns["robustness_trials"]) + 2)
    assert (np.diff(rank) <= 1e-12).all(), "best first"
    other = thorough.record.grasps.other_grippers["wsg50_110"]
    assert other.summary is not None and other.summary.trial.force_n == 80
    assert len(thorough.grasps(gripper="wsg50_110")) == other.summary.verified >= 1
    assert 0 <= other.transferred <= other.transferable


def test_require_agreement_verifies_only_what_both_engines_hold(thorough: Twin, tmp_path: Path) -> None:
    work = Path(".work") / thorough.record.twin_id
    shutil.copytree(thorough.folder.parents[2] / work, tmp_path / work)
    report = manitwin.build(
        SAMPLES / "mug.glb", tmp_path, name="mug", config=THOROUGH, require_agreement=True, **_said("mesh")
    )
    twin = manitwin.load(report.results[0].folder or "", verify=True)
    before, after = thorough.record.grasps, twin.record.grasps
    assert before is not None and after is not None and before.second_opinion is not None
    assert before.second_opinion.holds_share is not None
    assert after.verified == round(before.second_opinion.holds_share * before.verified)
    assert after.verified + sum(after.failures.values()) == after.simulated == before.simulated >= 16
    assert all(twin.grasps().columns["holds_in_second_engine"])
    assert set(twin.grasps().outcome) == {"held"}


def test_numbers_and_their_sources_are_in_the_record(samples: dict[str, Twin]) -> None:
    for twin in samples.values():
        physical = twin.physical
        for estimate in (physical.mass_kg, physical.friction_static, physical.friction_dynamic, physical.restitution):
            assert estimate.low <= estimate.value <= estimate.high
            assert estimate.source != "default"
        not_judged = [check.name for check in twin.record.quality.checks if check.passed is None]
        assert "visual_quality" in not_judged


@pytest.mark.slow
def test_killed_build_leaves_no_half_twin_and_goes_on(tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [
        sys.executable,
        "-m",
        "manitwin.cli.main",
        "build",
        str(SAMPLES / "mug.glb"),
        "-o",
        str(out),
        "--name",
        "mug",
        "-j",
        "1",
    ]
    settings = tmp_path / "quick.toml"
    settings.write_text("[grasps]\nsimulated = 16\nunfiltered = 4\n")
    command += ["--config", str(settings), "--quick"]
    process = subprocess.Popen(command, start_new_session=True, stderr=subprocess.PIPE)
    deadline = time.monotonic() + 240
    while not list(out.glob(".work/*/collision/*/result.json")) and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert not (out / "twins").exists()
    kept = {p: p.stat().st_mtime_ns for p in out.glob(".work/*/*/*/result.json")}
    assert kept
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert {p: p.stat().st_mtime_ns for p in kept} == kept, "finished stages are not run again"
    (folder,) = out.glob("twins/*/*")
    assert json.loads((folder / "twin.json").read_text())["status"] == "accepted"


def test_interrupted_build_says_so_and_exits_with_4(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "manitwin.cli.main",
        "build",
        str(SAMPLES / "mug.glb"),
        "-o",
        str(tmp_path / "out"),
        "-j",
        "1",
    ]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 240
    while not list((tmp_path / "out").glob(".work/*/mesh/*/result.json")) and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 4
    assert "interrupted" in errors and "Traceback" not in errors


def test_a_script_without_a_main_guard_builds_once(tmp_path: Path) -> None:
    (tmp_path / "empty.png").write_bytes(b"")
    script = tmp_path / "script.py"
    script.write_text("import manitwin\nprint(manitwin.build('empty.png', 'out', jobs=1).results[0].status)\n")
    done = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True)
    assert (done.stdout.strip(), done.returncode) == ("rejected", 0), done.stderr
