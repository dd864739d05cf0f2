"""Build a twin from a text for categories of all six groups, and count how many are verified.

    python benchmarks/texts.py DATASET [--categories N] [--count K] [--thorough]

The categories are spread evenly over each group's alphabetical order. An existing data set is continued, so a run may be stopped
at any time. Without ``--thorough`` one engine tries each grasp once (``build --quick``).
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from pathlib import Path

from manitwin import build
from manitwin.models.generators.templates.catalog import load_templates


def main() -> None:
    """Build, and print what was accepted by group, what was rejected, and the CPU seconds per twin."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--categories", type=int, default=60)
    parser.add_argument("--count", type=int, default=1)
    parser.add_argument("--thorough", action="store_true")
    arguments = parser.parse_args()
    groups = chosen(arguments.categories)
    texts = {text(category): group for group, categories in groups.items() for category in categories}
    report = build(
        [], arguments.dataset, texts=list(texts), count=arguments.count, jobs=1, quick=not arguments.thorough,
        on_result=lambda result: print(f"{result.status:10s} {result.item.title}: {result.detail}", flush=True),
    )  # fmt: skip
    ended = list(report.iterate())
    by_group = defaultdict(lambda: [0, 0])
    for result in ended:
        by_group[texts[result.item.text or ""]][result.status == "accepted"] += 1
    for group, (others, accepted) in sorted(by_group.items()):
        print(f"{group}: {accepted} of {accepted + others}")
    costs = [cpu_seconds(result.folder) for result in ended if result.folder is not None]
    accepted = sum(result.status == "accepted" for result in ended)
    print(f"{accepted} of {len(ended)} accepted, {sum(costs) / max(len(costs), 1):.1f} CPU-s each")


def chosen(categories: int) -> dict[str, list[str]]:
    """Return the chosen categories of each group: ``categories`` of each, or all of a smaller group."""
    templates = load_templates()
    groups: dict[str, list[str]] = defaultdict(list)
    for category in sorted(templates):
        groups[templates[category].group].append(category)
    each = categories // len(groups)
    return {
        group: [names[i * len(names) // each] for i in range(each)] if len(names) > each else names
        for group, names in sorted(groups.items())
    }


def text(category: str) -> str:
    """Return the category with its article."""
    return f"{'an' if category[0] in 'aeiou' else 'a'} {category}"


def cpu_seconds(folder: Path) -> float:
    """Return the CPU seconds of a twin's stages."""
    stages = json.loads((folder / "run.json").read_text(encoding="utf-8"))["stages"]
    return float(sum(cost["cpu_seconds"] for cost in stages.values()))


if __name__ == "__main__":
    main()
