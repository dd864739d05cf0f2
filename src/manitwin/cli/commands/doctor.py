"""``manitwin doctor``: what is there and what is missing, and whether a served model answers."""

from __future__ import annotations

import shutil
import sys
import sysconfig
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import out_console
from manitwin.errors import ManiTwinError, UsageError
from manitwin.formats.installation import missing_libraries, package_by_policy

if TYPE_CHECKING:
    from manitwin.config import BuildConfig

PACKAGES = (
    "sapien",
    "mujoco",
    "trimesh",
    "embreex",
    "manifold3d",
    "numpy",
    "scipy",
    "opencv-python",
    "pyarrow",
    "usd-core",
    "pycollada",
)
MIN_FREE_GB = 2


@dataclass(frozen=True)
class CheckResult:
    """The result of one check of this installation: ``name`` is what was checked."""

    name: str
    ok: bool
    detail: str


KINDS = {"vlm": "annotator", "generator": "generator", "grasper": "grasper"}
"""What the command calls a kind of backend, and what the registry and the configuration do."""


def doctor(
    what: Annotated[
        str | None,
        option_values.SERVED_KINDS.argument(
            help="vlm, generator or grasper: send one small request to this service; default: check this machine."
        ),
    ] = None,
    vlm: Annotated[
        str | None,
        option_values.ANNOTATORS.option(help="VLM to test (openai:MODEL@URL); default: the one in the configuration."),
    ] = None,
    generator: Annotated[
        str | None,
        option_values.GENERATORS.option(help="Generator to test (rodin); default: the one in the configuration."),
    ] = None,
    grasper: Annotated[
        str | None,
        option_values.GRASPERS.option(
            help="Grasper to test (graspgen@tcp://HOST:5556); default: the one in the configuration."
        ),
    ] = None,
    config: options.Config = None,
) -> None:
    """Check this machine for missing dependencies, or test whether a served model answers."""
    specs = {"vlm": vlm, "generator": generator, "grasper": grasper}
    if what is None:
        given = [f"--{name}" for name, spec in specs.items() if spec is not None]
        if given or config is not None:
            raise UsageError(
                f"doctor without an argument checks this machine and takes no options; to test a service, give one of"
                f" {', '.join(KINDS)} before the options"
            )
        findings, wrong = check_installation(), "missing"
    else:
        from manitwin.config import BuildConfig, load_config

        settings = load_config(config) if config else BuildConfig()
        wrong = "failed "
        findings = [probe_backend(KINDS[what], specs[what] or getattr(settings, KINDS[what]), settings)]
    for finding in findings:
        out_console.print(f"{'ok     ' if finding.ok else wrong} {finding.name}: {finding.detail}")
    raise typer.Exit(0 if all(finding.ok for finding in findings) else 4)


def probe_backend(kind: str, spec: str, settings: BuildConfig) -> CheckResult:
    """Send one small request to the backend of a spec: what works, what it cost and how long it took.

    No remembered answer is taken for one, and none is remembered. Raises UsageError for a name that no backend has, and for
    a backend that cannot be asked as it was given: its address, its key, its options.
    """
    from manitwin.engine.charges import record_charges
    from manitwin.models.registry import create, target

    target(kind, spec)
    services = settings.services.model_copy(update={"cache": False, "record": None})
    settings = settings.model_copy(update={"services": services})
    started = time.perf_counter()
    with record_charges() as bill:
        try:
            backend = create(kind, spec, settings)
            if not hasattr(backend, "probe"):
                return CheckResult(spec, True, "built in, no service to test")
            works, ok = backend.probe(), True
        except UsageError:
            raise
        except ManiTwinError as error:
            works, ok = str(error), False
    seconds = time.perf_counter() - started
    works += "; it is a rehearsal server, not a model" if bill.rehearsed else ""
    return CheckResult(spec, ok, f"{' '.join(works.split())} ({bill.usd:.4f} USD, {seconds:.1f} s)")


def check_installation() -> list[CheckResult]:
    """Look at Python, the packages, what they want of the system, physics, the renderer, the backends and the disk."""
    looks: tuple[tuple[str, Callable[[], str]], ...] = (
        ("python", _python),
        ("packages", _packages),
        ("shared libraries", _shared_libraries),
        ("physics", _physics),
        ("second engine", _second_engine),
        ("grippers", _grippers),
        ("ray casting", _ray_casting),
        ("renderer", _renderer),
        ("backends", _backends),
        ("disk", _disk),
    )
    return [_run_check(name, look) for name, look in looks]


def _run_check(name: str, look: Callable[[], str]) -> CheckResult:
    try:
        return CheckResult(name, True, look())
    except (ManiTwinError, ImportError, RuntimeError, OSError) as error:
        return CheckResult(name, False, " ".join(str(error).split()))


def _python() -> str:
    return f"{sys.version.split()[0]} at {sys.executable}"


def _packages() -> str:
    from importlib.metadata import PackageNotFoundError, version  # a tenth of what --help takes

    missing, found = [], []
    for package in PACKAGES:
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            missing.append(package)
    if missing:
        raise ImportError(f"{', '.join(missing)} not installed; run: make setup")
    return ", ".join(found)


def _shared_libraries() -> str:
    places = sorted({sysconfig.get_path("platlib"), sysconfig.get_path("purelib")})
    missing = sorted({library for place in places for library in missing_libraries(Path(place))})
    if missing:
        packages = " ".join(sorted({package_by_policy(library) for library in missing}))
        raise ImportError(
            f"{', '.join(missing)} not found by the dynamic loader; on Debian and Ubuntu run: sudo apt-get update &&"
            f" sudo apt-get install -y --no-install-recommends {packages} (if a package name is unknown there, find it"
            " with apt-file search)"
        )
    return "the dynamic loader finds all libraries of the installed packages"


def _physics() -> str:
    import sapien
    import sapien.physx

    scene = sapien.Scene([sapien.physx.PhysxCpuSystem()])
    scene.step()
    return f"SAPIEN {sapien.__version__} steps a scene (PhysX on the CPU)"


def _second_engine() -> str:
    import mujoco

    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    mujoco.mj_step(model, mujoco.MjData(model))
    return f"MuJoCo {mujoco.__version__} steps a scene"


def _grippers() -> str:
    from manitwin.robots.grippers.gripper import load_gripper, shipped_grippers

    usable, left_out = [], []
    for name in shipped_grippers():
        try:
            usable.append(load_gripper(name).name)
        except ManiTwinError as error:  # a hand whose files come with an extra
            left_out.append(str(error))
    return "; ".join([", ".join(usable), *left_out])


def _ray_casting() -> str:
    import trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    hit = RayMeshIntersector(trimesh.creation.box()).intersects_any([[0, 0, 2]], [[0, 0, -1]])
    if not hit.all():
        raise RuntimeError("embree returned a wrong hit in a ray casting test; reinstall embreex")
    return "embree passes a ray casting test"


def _renderer() -> str:
    from manitwin.render.device import renderer_summary

    return renderer_summary()


def _backends() -> str:
    from manitwin.models.registry import backends

    return "; ".join(f"{kind}: {', '.join(sorted(names))}" for kind, names in sorted(backends().items()))


def _disk() -> str:
    free = shutil.disk_usage(Path.cwd()).free / 1e9
    if free < MIN_FREE_GB:
        raise OSError(f"{free:.1f} GB free here; a thousand twins need about 10 GB")
    return f"{free:.0f} GB free here"
