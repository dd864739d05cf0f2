"""Look up known vulnerabilities (PyPA and GitHub advisories) of the locked packages in the package index.

``make vulnerabilities``. Exit status 1: some are known. 4: the index did not answer for every version; the versions that were not
checked are listed. A mirror of PyPI may only know the newest version of a package; older versions are then not checked.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import httpx2
from locked_licences import LOCK, locked

INDEX = os.environ.get("MANITWIN_PYPI_JSON", "https://pypi.org/pypi")
AT_ONCE = 4
TIMEOUT_S = 60

Fetch = Callable[[str], dict[str, Any] | None]


@dataclass(frozen=True)
class Known:
    """Index data on a version: ``advisories`` with the versions that fix them, or None if the index has no data."""

    name: str
    version: str
    advisories: dict[str, list[str]] | None


def fetch(path: str) -> dict[str, Any] | None:
    """Return the index's JSON of ``NAME/VERSION`` or ``NAME``, or None if it has none."""
    try:
        answer = httpx2.get(f"{INDEX}/{path}/json", timeout=TIMEOUT_S, follow_redirects=True)
        return answer.json() if answer.status_code == 200 else None
    except (httpx2.HTTPError, json.JSONDecodeError):
        return None


def known(name: str, version: str, ask: Fetch = fetch) -> Known:
    """Return the advisories on a locked version, from its own page or, for the newest version, from the project's."""
    for path in (f"{name}/{version}", name):
        page = ask(path)
        if page is not None and page["info"]["version"] == version and "vulnerabilities" in page:
            valid = [advisory for advisory in page["vulnerabilities"] if not advisory.get("withdrawn")]
            return Known(name, version, {advisory["id"]: advisory.get("fixed_in") or [] for advisory in valid})
    return Known(name, version, None)


def report(found: list[Known]) -> int:
    """Print the results and return the exit status."""
    for package in found:
        for advisory, fixed in (package.advisories or {}).items():
            print(f"{package.name} {package.version}: {advisory}, mended in {', '.join(fixed) or 'no version'}")
    unchecked = [f"{package.name} {package.version}" for package in found if package.advisories is None]
    bad = [package for package in found if package.advisories]
    print(
        f"{len(found) - len(unchecked)} of {len(found)} locked versions looked up: {len(bad)} with known vulnerabilities"
    )
    if unchecked:
        print(f"not checked, the index has no answer for this version: {', '.join(unchecked)}", file=sys.stderr)
    return 1 if bad else 4 if unchecked else 0


def main() -> None:
    with ThreadPoolExecutor(AT_ONCE) as threads:
        found = list(threads.map(lambda package: known(*package), locked(LOCK.read_text(encoding="utf-8"))))
    sys.exit(report(found))


if __name__ == "__main__":
    main()
