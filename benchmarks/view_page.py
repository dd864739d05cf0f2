"""Time a page of ``manitwin view`` in a real Chromium without a GPU, and the CPU time of all its processes.

    manitwin view DATASET --no-browser
    python benchmarks/view_page.py LINK /twin/ID [--times 9]

``LINK`` is the one-time link that the command prints. For every second load the browser's cache is empty. Printed are the time
from the start of navigation to two frames after the last mesh was given to the renderer (``performance.now``), and the CPU
seconds of the browser's processes (/proc, Linux). On a busy machine the first is unreliable, and the second is an upper limit for
an idle machine, whose cores work in parallel.
"""

from __future__ import annotations

import argparse
import os
import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import sync_playwright

BROWSERS = ("chromium", "chromium-browser", "google-chrome-stable", "google-chrome")
WITHOUT_GPU = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
BAR_S = 2.0
_TICKS = os.sysconf("SC_CLK_TCK")


def processes(root: int) -> dict[int, float]:
    """Return the CPU seconds of all descendants of a process, by process id."""
    of_parent: dict[int, list[tuple[int, float]]] = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, _, rest = path.read_text().rpartition(")")
        except OSError:  # the process has ended
            continue
        fields = rest.split()
        seconds = (int(fields[11]) + int(fields[12])) / _TICKS
        of_parent.setdefault(int(fields[1]), []).append((int(name.split()[0]), seconds))
    found: dict[int, float] = {}
    left = [root]
    while left:
        for number, seconds in of_parent.get(left.pop(), []):
            found[number] = seconds
            left.append(number)
    return found


def shown(page: Any, address: str) -> tuple[float, float]:
    """Return the seconds until a page is drawn, and the CPU seconds of the browser."""
    page.goto("about:blank")
    time.sleep(0.5)
    before = processes(os.getpid())
    page.goto(address)
    page.wait_for_selector("#viewer[data-ready]", timeout=120_000)
    after = processes(os.getpid())
    ready = float(page.evaluate("document.getElementById('viewer').dataset.ready")) / 1000
    return ready, sum(seconds - before.get(number, 0.0) for number, seconds in after.items())


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("link")
    parser.add_argument("path", help="/twin/ID, /scene/ID or /episode/NUMBER, and what belongs behind #")
    parser.add_argument("--times", type=int, default=9)
    given = parser.parse_args()
    with sync_playwright() as playwright:
        path = next(found for name in BROWSERS if (found := shutil.which(name)))
        browser = playwright.chromium.launch(executable_path=path, args=WITHOUT_GPU)
        context = browser.new_context(viewport={"width": 1280, "height": 900})
        page = context.new_page()
        page.goto(given.link)
        rows = []
        for number in range(given.times):
            if number % 2 == 0:
                session = context.new_cdp_session(page)
                session.send("Network.clearBrowserCache")
                session.detach()
            rows.append(shown(page, given.link.split("/enter")[0] + given.path))
        browser.close()
    ready, cpu = np.array(rows).T
    print(f"{given.path}, {len(rows)} times, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    for what, values in (("until drawn, s", ready), ("CPU of the browser, s", cpu)):
        print(f"{what:<22} least {values.min():.2f}  median {np.median(values):.2f}  most {values.max():.2f}")
    print(f"within {BAR_S:.0f} s: {(ready <= BAR_S).sum()} of {len(rows)}")


if __name__ == "__main__":
    main()
