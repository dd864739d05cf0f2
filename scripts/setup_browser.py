"""Install Chromium from the system's packages for the tests marked browser. Run by make with the Python of ``.venv``.

Playwright drives the system's browser instead of downloading its own. On Debian the package is ``chromium``; without apt-get, a
message names the package to install.
"""

from __future__ import annotations

import shutil
import subprocess
import sys

from setup import apt_install, say, stop

NAMES = ("chromium", "chromium-browser", "google-chrome-stable", "google-chrome")


def installed() -> str | None:
    """Return the path of a Chromium on the search path, or None."""
    return next((path for name in NAMES if (path := shutil.which(name)) is not None), None)


def main() -> None:
    if installed() is None:
        say("the browser tests want Chromium: installing the system's package")
        if not apt_install(["chromium"], "the browser tests want Chromium, which is not installed"):
            sys.exit(1)
    browser = installed()
    if browser is None:
        stop(f"the package chromium is installed, but none of these is on the search path: {', '.join(NAMES)}")
        return
    probe = subprocess.run([browser, "--version"], capture_output=True, text=True, timeout=60)
    if probe.returncode != 0:
        stop(f"{browser} --version fails: {(probe.stderr or probe.stdout).strip()[:300]}")
    say(f"browser tests use {probe.stdout.strip()} ({browser})")


if __name__ == "__main__":
    main()
