"""Count how many of the assets below folders can be read: `python benchmarks/assets_read.py FOLDER... [--most N] [--seed S]`.

Files whose name says that they are malformed or invalid on purpose, as tests of loaders have them, are counted separately. Every
other asset that cannot be read is listed with its error. Of a folder with more than ``--most`` assets, that many are drawn at
random.
"""

from __future__ import annotations

import argparse
import random
import re
from pathlib import Path

from manitwin.assets.audit.run import audit_all, rules_selected
from manitwin.assets.read import find_assets

UNREAD = ("FIL001", "FIL005", "FIL006")
ON_PURPOSE = re.compile(r"(^|[_\W])(malformed|invalid)", re.IGNORECASE)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--most", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    total, read, spoilt = 0, 0, 0
    rules = rules_selected(UNREAD)
    for folder in options.folders:
        fragments: list[Path] = []
        templates: list[Path] = []
        found = list(find_assets(folder, fragments, templates))
        if len(found) > options.most:
            found = sorted(random.Random(options.seed).sample(found, options.most))
        on_purpose = [path for path in found if ON_PURPOSE.search(path.name)]
        meant = [path for path in found if path not in on_purpose]
        unread = []
        for audited in audit_all(meant, rules, named=[folder]):
            unread += [(audited.asset, finding.message) for finding in audited.findings if finding.code in UNREAD]
        print(
            f"{folder.name}: {len(meant) - len(unread)} of {len(meant)} read; {len(on_purpose)} broken on purpose,"
            f" {len(fragments)} fragments and {len(templates)} templates apart",
            flush=True,
        )
        for asset, message in unread:
            print(f"  {Path(asset).relative_to(folder)}: {message[:160]}")
        for path in on_purpose:
            print(f"  on purpose: {path.relative_to(folder)}")
        total, read, spoilt = total + len(meant), read + len(meant) - len(unread), spoilt + len(on_purpose)
    print(f"together {read} of {total} read = {read / max(1, total):.1%}; {spoilt} broken on purpose are not counted")


if __name__ == "__main__":
    main()
