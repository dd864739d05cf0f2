"""Set up ``.venv``: the locked packages, this package, the system libraries that they need, and a Vulkan driver.

Runs with the system's Python alone (3.11+) on Debian 12 and 13 and Ubuntu 24.04. A second run takes a second: a stamp file in the
environment holds the digest of the lock and of ``pyproject.toml``. Steps that need root are run if permitted; otherwise the
required command is printed.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "src"))  # the package is not installed yet

from manitwin.formats.installation import missing_libraries, package_by_contents, package_by_policy  # noqa: E402

VENV = ROOT / ".venv"
STAMP = VENV / "manitwin-setup.sha256"
LIBRARIES_STAMP = VENV / "manitwin-libraries.sha256"
BACKPORTS = Path("/etc/apt/sources.list.d/manitwin-backports.sources")
ENVIRONMENT_BYTES = 3_800_000_000
"""Size of the installed packages (du of ``.venv``: 3.9e9); pip needs more during the installation."""


def say(text: str) -> None:
    print(f"setup: {text}", flush=True)


def stop(text: str) -> None:
    sys.exit(f"setup: {text}")


def as_root(command: list[str]) -> list[str] | None:
    """Return the command in the form that this user can run as root without a password, or None."""
    if os.geteuid() == 0:
        return command
    sudo = shutil.which("sudo")
    if sudo and subprocess.run([sudo, "-n", "true"], capture_output=True).returncode == 0:
        return [sudo, "-n", "env", "DEBIAN_FRONTEND=noninteractive", *command]
    return None


def distribution() -> tuple[str, str]:
    """Return the id and code name of the distribution ('debian', 'bookworm')."""
    release = Path("/etc/os-release")
    fields = (
        dict(line.split("=", 1) for line in release.read_text().splitlines() if "=" in line)
        if release.is_file()
        else {}
    )
    return fields.get("ID", "").strip('"'), fields.get("VERSION_CODENAME", "").strip('"')


def apt_install(packages: list[str], why: str, extra: list[str] | None = None, before: str = "") -> bool:
    """Install Debian packages, or print the command if not permitted. Returns whether they are installed."""
    arguments = ["apt-get", "install", "-y", "--no-install-recommends", *(extra or []), *packages]
    command = as_root(arguments)
    by_hand = f"{before}sudo apt-get update && sudo {' '.join(arguments)}"
    if shutil.which("apt-get") is None or command is None:
        say(f"{why}. Run this, then again: {by_hand}")
        return False
    update = as_root(["apt-get", "update", "-qq"])
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for step in (update, command):
        done = subprocess.run(step or [], capture_output=True, text=True, env=environment)
        if done.returncode != 0 and step is command:
            reason = (done.stderr.strip().splitlines() or ["no message"])[-1]
            say(f"{why}; apt-get failed: {reason}. By hand: {by_hand}")
            return False
    return True


def make_environment() -> None:
    """Create the virtual environment with pip."""
    if (VENV / "bin" / "python").exists() and subprocess.run(
        [VENV / "bin" / "python", "-m", "pip", "--version"], capture_output=True
    ).returncode == 0:
        return
    shutil.rmtree(VENV, ignore_errors=True)
    try:
        import ensurepip  # noqa: F401
    except ImportError:
        version = f"python{sys.version_info.major}.{sys.version_info.minor}-venv"
        if not apt_install([version], f"this Python cannot make virtual environments without {version}"):
            sys.exit(1)
    say("making .venv")
    subprocess.run([sys.executable, "-m", "venv", str(VENV)], check=True)


def wanted_digest() -> str:
    """Return the digest of the files that determine the content of the environment."""
    parts = [(ROOT / name).read_bytes() for name in ("requirements.lock", "pyproject.toml")]
    return hashlib.sha256(b"\0".join([*parts, sys.version.encode()])).hexdigest()


def require_room() -> None:
    """Stop if the packages do not fit on the disk; pip would fail only after minutes of downloads."""
    there = sum(path.lstat().st_blocks for path in VENV.rglob("*")) * 512
    free = shutil.disk_usage(ROOT).free
    if free + there < ENVIRONMENT_BYTES:
        stop(
            f"{ROOT} has {free / 1e9:.1f} GB free, the packages take {(ENVIRONMENT_BYTES - there) / 1e9:.1f} GB and some more"
            " while they are installed; free the disk or set up on another one"
        )


def install_packages() -> None:
    """Install the locked packages, verified by hash, and this package in editable mode."""
    digest = wanted_digest()
    if STAMP.is_file() and STAMP.read_text() == digest:
        return
    if not STAMP.is_file():
        require_room()
    pip = [str(VENV / "bin" / "python"), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    say("installing the locked packages (a few minutes, once)")
    for what in (
        ["--require-hashes", "-r", str(ROOT / "requirements.lock")],
        ["--no-deps", "--no-build-isolation", "-e", str(ROOT)],
    ):
        if subprocess.run([*pip, *what]).returncode != 0:
            stop("pip could not install the packages, for the reason above; mend it, then run the same command again")
    STAMP.write_text(digest)


def compile_sources() -> None:
    """Compile this package's outdated or missing bytecode.

    Programs then start half a second faster. Python does not do so itself if PYTHONDONTWRITEBYTECODE is set, as is common in
    containers and on test servers.
    """
    subprocess.run([str(VENV / "bin" / "python"), "-m", "compileall", "-q", "-j", "0", str(ROOT / "src")], check=False)


def install_libraries() -> None:
    """Install the system's shared libraries that the installed wheels need, according to the loader.

    The check is repeated only if packages or the system's libraries have changed.
    """
    known = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True).stdout
    digest = hashlib.sha256(wanted_digest().encode() + known).hexdigest()
    if LIBRARIES_STAMP.is_file() and LIBRARIES_STAMP.read_text() == digest:
        return
    for packages_of in (packages_by_policy, packages_by_contents):
        missing = missing_libraries(VENV)
        if not missing:
            break
        why = f"shared libraries are missing: {', '.join(missing)}"
        if shutil.which("apt-get") is None:
            stop(f"{why}. Install the packages of this system that have them, then run this again")
        packages = packages_of(missing)
        if packages:
            say(f"{why}: installing {' '.join(packages)}")
            if not apt_install(packages, why):
                sys.exit(1)
    missing = missing_libraries(VENV)
    if missing:
        stop(f"no package was found for {', '.join(missing)}; install what has them, then run this again")
    known = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True).stdout
    LIBRARIES_STAMP.write_text(hashlib.sha256(wanted_digest().encode() + known).hexdigest())


def packages_by_policy(libraries: list[str]) -> list[str]:
    """Return the existing Debian packages with the names that Debian Policy gives to the libraries' packages."""
    update = as_root(["apt-get", "update", "-qq"])
    if update is not None:
        subprocess.run(update, capture_output=True)
    named = sorted({package_by_policy(library) for library in libraries})
    return [name for name in named if subprocess.run(["apt-cache", "show", name], capture_output=True).returncode == 0]


def packages_by_contents(libraries: list[str]) -> list[str]:
    """Return the Debian packages that contain the libraries, by apt-file's index, which is installed if needed."""
    if not apt_install(["apt-file"], "apt-file is needed to find the packages of shared libraries"):
        sys.exit(1)
    subprocess.run(as_root(["apt-file", "update"]) or [], capture_output=True)
    found = []
    for library in libraries:
        search = subprocess.run(["apt-file", "search", f"/{library}"], capture_output=True, text=True)
        found.append(package_by_contents(library, search.stdout.splitlines()))
    return sorted({package for package in found if package is not None})


def can_render() -> bool:
    """Return whether a Vulkan device can render, by the package's own probe, which prints the device's name."""
    probe = [str(VENV / "bin" / "python"), "-m", "manitwin.render.device"]
    done = subprocess.run(probe, capture_output=True, text=True)
    return done.returncode == 0 and bool(done.stdout.strip())


def debian_mirror() -> str:
    """Return the Debian 12 mirror that this system uses."""
    ask = ["apt-get", "indextargets", "--format", "$(REPO_URI)", "Codename: bookworm"]
    known = subprocess.run(ask, capture_output=True, text=True).stdout.split()
    if not known:
        stop("no Debian mirror is set up; enable bookworm-backports by hand, then run this again")
    return known[0]


def install_renderer() -> None:
    """Install Mesa's lavapipe if no Vulkan device can render; on Debian 12 from backports, since the version of bookworm is too
    old.
    """
    if can_render():
        return
    name, codename = distribution()
    extra: list[str] = []
    by_hand = ""
    if (name, codename) == ("debian", "bookworm"):
        extra = ["-t", "bookworm-backports"]
        source = (
            f"Types: deb\nURIs: {debian_mirror()}\nSuites: bookworm-backports\nComponents: main\n"
            "Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg\n"
        )
        by_hand = f"printf '{source.encode('unicode_escape').decode()}' | sudo tee {BACKPORTS} && "
        writer = as_root(["tee", str(BACKPORTS)])
        if writer is not None and not BACKPORTS.exists():
            subprocess.run(writer, input=source, text=True, check=True, stdout=subprocess.DEVNULL)
    say("no Vulkan device can render: installing Mesa's lavapipe")
    if not apt_install(["mesa-vulkan-drivers", "libvulkan1"], "no Vulkan device can render", extra, by_hand):
        sys.exit(1)
    if not can_render():
        stop("Mesa is installed, but no Vulkan device can render; run .venv/bin/manitwin doctor for the reason")


def main() -> None:
    if sys.version_info < (3, 11):  # noqa: UP036  this file runs before pip can refuse an older Python
        stop(
            f"Python 3.11 or newer is needed, this is {sys.version.split()[0]}; name one with: make PYTHON=python3.12 setup"
        )
    make_environment()
    install_packages()
    compile_sources()
    install_libraries()
    install_renderer()


if __name__ == "__main__":
    main()
