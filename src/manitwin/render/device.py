"""Selection of SAPIEN's Vulkan device: a GPU if one works, otherwise the CPU through Mesa's lavapipe.

SAPIEN requests a device from the Vulkan loader with its first RenderSystem, and the loader reads its environment variables
then, so that ``require_renderer`` must be called before. Each candidate is tried in a separate process, because a driver may
crash or hang. The result is stored in an environment variable for child processes.
"""

from __future__ import annotations

import fcntl
import glob
import json
import logging
import os
import platform
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

from manitwin.errors import ManiTwinError, RendererMissing, UsageError
from manitwin.formats.installation import block_import

RUN = logging.getLogger("manitwin.run")
SWITCH = "MANITWIN_RENDER_DEVICE"
"""Set to ``cpu`` to avoid GPUs (some hang: vla-evaluation-harness#112); default ``auto``."""

FOUND = "MANITWIN_RENDER_DEVICE_FOUND"
FOUND_AT = "MANITWIN_RENDER_DEVICE_FOUND_AT"
"""Names the file through which the processes of a run share the device that the first of them found."""

LOADER_VARIABLES = ("VK_DRIVER_FILES", "VK_ICD_FILENAMES")
"""Environment variables of the Vulkan loader: the first since 1.3.207, the second before (LoaderInterfaceArchitecture.md)."""

ICD_FOLDERS = (
    "/usr/share/vulkan/icd.d",
    "/etc/vulkan/icd.d",
    "/usr/local/share/vulkan/icd.d",
    "/usr/local/etc/vulkan/icd.d",
)
PROBE_SECONDS = 120.0  # a device that takes longer for a small image hangs or is useless

# Creating a RenderSystem fails with an unsuitable driver. A GPU must also render an image, because without the right libraries
# in a container it fails or hangs only then. Lavapipe is not asked for an image, as SAPIEN's own shaders compile for 6
# CPU-seconds. The probe replaces SAPIEN's imports for downloads and kinematics, half of its import time; SAPIEN works without
# the latter.
_PROBE = """
import sys, types
sys.modules["requests"], sys.modules["pinocchio"] = types.ModuleType("requests"), None
import sapien.render as render
print(render.get_device_summary())
import sapien
scene = sapien.Scene([render.RenderSystem()])
if sys.argv[1] == "picture":
    entity, camera = sapien.Entity(), render.RenderCameraComponent(16, 16)
    entity.add_component(camera)
    scene.add_entity(entity)
    scene.update_render()
    camera.take_picture()
    camera.get_picture("Color")
print("it renders")
"""


@dataclass(frozen=True)
class RenderDevice:
    """A working device, by driver name; ``driver_file`` is pinned for the loader (None: the loader's choice)."""

    name: str
    driver_file: str | None

    @property
    def is_software(self) -> bool:
        """Return whether this is a software renderer rather than a GPU."""
        return "llvmpipe" in self.name or "SwiftShader" in self.name


def render_scene(picture_formats: Mapping[str, str]) -> tuple[Any, Any]:
    """Return the SAPIEN module and an empty scene for rendering, with these image formats. Raises RendererMissing."""
    require_renderer()
    with warnings.catch_warnings(), block_import("pinocchio"):  # 45 MB; SAPIEN has its own copy, which is not used here
        warnings.simplefilter("ignore")  # SAPIEN warns about optional drivers
        import sapien
        import sapien.render
    sapien.render.set_log_level("error")
    for picture, pixel_format in picture_formats.items():
        sapien.render.set_picture_format(picture, pixel_format)
    return sapien, sapien.Scene([sapien.render.RenderSystem()])


def require_renderer() -> RenderDevice:
    """Select the device, set the Vulkan loader's environment for it, and return it.

    Raises RendererMissing if no device renders, and UsageError if MANITWIN_RENDER_DEVICE is neither auto nor cpu.
    """
    question = {"switch": _device_setting(), **{name: os.environ.get(name) for name in LOADER_VARIABLES}}
    known = json.loads(os.environ.get(FOUND, "null"))
    if known is not None and known["question"] == question:
        return RenderDevice(**known["device"])
    device = _find_shared_device(question)
    if device.driver_file is not None:
        for name in LOADER_VARIABLES:
            os.environ[name] = device.driver_file
            question[name] = device.driver_file
    os.environ[FOUND] = json.dumps({"question": question, "device": asdict(device)})
    return device


def require_driver() -> None:
    """Raise RendererMissing if no driver is installed; an installed driver is not tried, which would take a process."""
    named, ways = _driver_candidates(_device_setting() == "cpu")
    if not ways or (named is not None and not any(map(os.path.exists, named.split(os.pathsep)))):
        require_renderer()


@contextmanager
def share_device_search() -> Iterator[None]:
    """Make this process and those started within the ``with`` statement search for the device only once.

    The first process that needs it searches, and others wait for the result.
    """
    with tempfile.TemporaryDirectory(prefix="manitwin-") as folder:
        os.environ[FOUND_AT] = os.path.join(folder, "device.json")
        try:
            yield
        finally:
            del os.environ[FOUND_AT]


def _find_shared_device(question: dict[str, str | None]) -> RenderDevice:
    """Return the device that another process of this run found for the same question, or search and share the result."""
    place = os.environ.get(FOUND_AT)
    if place is None:
        return _find_device(question)
    with open(place, "a+", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # released when the file is closed or the process ends
        file.seek(0)
        said = file.read()
        known = json.loads(said) if said.endswith("}") else None  # incomplete if a process was killed while writing
        if known is not None and known["question"] == question:
            return RenderDevice(**known["device"])
        device = _find_device(question)
        file.truncate(0)
        file.write(json.dumps({"question": question, "device": asdict(device)}))
        return device


def _find_device(question: dict[str, str | None]) -> RenderDevice:
    device = _first_working(question["switch"] == "cpu")
    why = f"{SWITCH}=cpu" if question["switch"] == "cpu" else "the first that renders, GPUs before the CPU"
    RUN.info("renderer: %s, driver %s (%s)", device.name, device.driver_file or "chosen by the loader", why)
    return device


def renderer_summary() -> str:
    """Describe the rendering device in one line. Raises RendererMissing if there is none."""
    device = require_renderer()
    kind = "on the CPU" if device.is_software else "GPU"
    return f"{device.name}, {kind}, driver {device.driver_file or 'chosen by the loader'}"


def _device_setting() -> str:
    value = os.environ.get(SWITCH, "auto")
    if value not in ("auto", "cpu"):
        raise UsageError(f"{SWITCH}={value!r} is unknown; valid: auto, cpu")
    return value


def _driver_candidates(cpu_only: bool) -> tuple[str | None, list[str | None]]:
    """Return the driver files named by the user, and the drivers to try in order (None: the loader's choice)."""
    named = next((os.environ[name] for name in LOADER_VARIABLES if os.environ.get(name)), None)
    if cpu_only and named is not None and "lvp" not in named:
        named = None  # the switch takes precedence
    if named is not None:
        return named, [None]  # no other driver is tried
    ways: list[str | None] = []
    if not cpu_only and (glob.glob("/dev/nvidia[0-9]*") or glob.glob("/dev/dri/renderD*") or glob.glob("/dev/dxg")):
        ways.append(None)
    return None, [*ways, *sorted(path for folder in ICD_FOLDERS for path in glob.glob(f"{folder}/lvp_icd*.json"))]


def _first_working(cpu_only: bool) -> RenderDevice:
    """Try the devices in order of preference and return the first that renders."""
    named, ways = _driver_candidates(cpu_only)
    causes = []
    for driver_file in ways:
        name, cause = _probe(driver_file, picture=driver_file is None and named is None)
        if name is not None:
            return RenderDevice(name, driver_file)
        causes.append(f"{driver_file or named or 'the GPU driver'}: {cause}")
    cause = "; ".join(causes) or "no Vulkan driver of Mesa's lavapipe is installed"
    raise RendererMissing(f"no Vulkan device can render ({cause}); {_remedy(named)}")


def _probe(driver_file: str | None, *, picture: bool) -> tuple[str | None, str]:
    """Try a device in a separate process; return its name (None: it does not render) and the cause of a failure."""
    environment = dict(os.environ)
    if driver_file is not None:
        environment.update(dict.fromkeys(LOADER_VARIABLES, driver_file))
    command = [sys.executable, "-W", "ignore", "-c", _PROBE, "picture" if picture else "device"]
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PROBE_SECONDS)
    except subprocess.TimeoutExpired:
        return None, f"no picture in {PROBE_SECONDS:.0f} s"
    if done.returncode != 0 or "it renders" not in done.stdout:
        said = [line for line in done.stderr.strip().splitlines() if line.strip()]
        return None, said[-1].strip() if said else f"the probe ended with code {done.returncode}"
    names = [line.split(":", 1)[1].strip() for line in done.stdout.splitlines() if line.strip().startswith("GPU:")]
    return (names or ["unnamed Vulkan device"])[0], ""


def _remedy(named: str | None) -> str:
    """Return the command that installs a renderer on this system."""
    if named is not None:
        return f"unset {' and '.join(LOADER_VARIABLES)}, or point them at a driver that works"
    release = platform.freedesktop_os_release() if os.path.exists("/etc/os-release") else {}
    family = {release.get("ID", ""), *release.get("ID_LIKE", "").split()}
    if release.get("VERSION_CODENAME") == "bookworm":
        # SAPIEN 3.0.3 rejects Debian 12's own Mesa 22.3.6; 25.0.7 from its backports works (measured).
        return (
            "run: echo \"deb $(apt-get indextargets --format '$(REPO_URI)' 'Codename: bookworm' | head -1)"
            ' bookworm-backports main"'
            " | sudo tee /etc/apt/sources.list.d/backports.list && sudo apt-get update"
            " && sudo apt-get install -y -t bookworm-backports mesa-vulkan-drivers"
        )
    if family & {"debian", "ubuntu"}:
        return "run: sudo apt-get install -y mesa-vulkan-drivers"
    if "fedora" in family:
        return "run: sudo dnf install -y mesa-vulkan-drivers"
    return "install Mesa's Vulkan drivers with lavapipe, version 25 or newer"


def main() -> int:
    """Print the rendering device, or the reason why there is none to stderr; return the exit status 0 or 1."""
    try:
        print(renderer_summary())
    except ManiTwinError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
