"""Choosing the Vulkan device."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from manitwin.errors import RendererMissing, UsageError
from manitwin.render import device

ASK = "from manitwin.render.device import renderer_summary; print(renderer_summary())"


def ask(**environment: str) -> subprocess.CompletedProcess[str]:
    kept = {name: value for name, value in os.environ.items() if name not in (*device.LOADER_VARIABLES, device.FOUND)}
    return subprocess.run([sys.executable, "-c", ASK], env=kept | environment, capture_output=True, text=True)


def test_missing_driver_is_one_line_with_cause_and_remedy(tmp_path: Path) -> None:
    nowhere = str(tmp_path / "nothing.json")
    done = ask(VK_DRIVER_FILES=nowhere)
    assert done.returncode != 0
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("manitwin.errors.RendererMissing: no Vulkan device can render")
    assert nowhere in last
    assert "unset VK_DRIVER_FILES" in last


def test_cpu_switch_overrides_a_named_driver(tmp_path: Path) -> None:
    done = ask(VK_DRIVER_FILES=str(tmp_path / "nothing.json"), MANITWIN_RENDER_DEVICE="cpu")
    assert done.returncode == 0, done.stderr
    assert "llvmpipe" in done.stdout
    assert "on the CPU" in done.stdout


def test_crashing_probe_is_an_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "_PROBE", "import os; os.abort()")
    for name in (*device.LOADER_VARIABLES, device.FOUND):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(RendererMissing, match="code -6"):
        device.require_renderer()


def test_found_device_is_not_probed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    first = device.require_renderer()
    monkeypatch.setattr(device, "_probe", lambda *_, **__: pytest.fail("probed again"))
    assert device.require_renderer() == first
    assert os.environ[device.FOUND]


def test_unknown_switch_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(device.SWITCH, "gpu7")
    with pytest.raises(UsageError, match="valid: auto, cpu"):
        device.require_renderer()


@pytest.mark.parametrize(
    ("release", "command"),
    [
        ({"ID": "debian", "VERSION_CODENAME": "bookworm"}, "-t bookworm-backports mesa-vulkan-drivers"),
        (
            {"ID": "ubuntu", "ID_LIKE": "debian", "VERSION_CODENAME": "noble"},
            "sudo apt-get install -y mesa-vulkan-drivers",
        ),
        ({"ID": "fedora"}, "sudo dnf install -y mesa-vulkan-drivers"),
        ({"ID": "arch"}, "version 25 or newer"),
    ],
)
def test_remedy_is_the_system_s_own_command(
    monkeypatch: pytest.MonkeyPatch, release: dict[str, str], command: str
) -> None:
    monkeypatch.setattr(device, "ICD_FOLDERS", ())
    monkeypatch.setattr(device.glob, "glob", lambda _: [])
    monkeypatch.setattr(device.platform, "freedesktop_os_release", lambda: release)
    for name in (*device.LOADER_VARIABLES, device.FOUND):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(RendererMissing) as caught:
        device.require_renderer()
    assert command in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_renderer_loads_no_kinematics() -> None:
    program = "import sys; from manitwin.render.device import render_scene; render_scene({}); print('pinocchio' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_one_process_of_a_run_looks_for_the_device_and_tells_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    probed: list[str | None] = []

    def probe(driver_file: str | None, *, picture: bool) -> tuple[str | None, str]:
        probed.append(driver_file)
        return (None, "no device") if len(probed) == 1 else ("llvmpipe", "")

    def forget() -> None:  # as another process knows nothing
        for name in (*device.LOADER_VARIABLES, device.FOUND):
            monkeypatch.delenv(name, raising=False)

    monkeypatch.setattr(device, "_probe", probe)
    monkeypatch.setattr(
        device.glob, "glob", lambda pattern: ["/lvp_icd.json"] if pattern.startswith("/usr/share") else []
    )
    with device.share_device_search():
        forget()
        with pytest.raises(RendererMissing):
            device.require_renderer()
        found = device.require_renderer()
        forget()
        assert device.require_renderer() == found and len(probed) == 2, "what was found is kept, what was not is not"
        assert os.environ[device.LOADER_VARIABLES[0]] == "/lvp_icd.json"
        forget()
        monkeypatch.setenv(device.SWITCH, "cpu")
        device.require_renderer()
        assert len(probed) == 3, "another question"
    assert device.FOUND_AT not in os.environ
    forget()


@pytest.mark.parametrize("named", ["", "/nowhere/a.json:/nowhere/b.json"])
def test_without_any_driver_nothing_is_begun(monkeypatch: pytest.MonkeyPatch, named: str) -> None:
    for name in (*device.LOADER_VARIABLES, device.FOUND):
        monkeypatch.delenv(name, raising=False)
    if named:
        monkeypatch.setenv(device.LOADER_VARIABLES[0], named)
    monkeypatch.setattr(device.glob, "glob", lambda pattern: [])
    with pytest.raises(RendererMissing, match="no Vulkan device can render"):
        device.require_driver()


def test_a_driver_that_is_there_is_not_tried_before_it_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "_probe", lambda *_, **__: pytest.fail("it was tried"))
    device.require_driver()
