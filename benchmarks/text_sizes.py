"""Make every template with several stated sides, and every vessel with a stated volume, and print how many succeed.

    python benchmarks/text_sizes.py [--seed 5] [--volume "400 ml"]

The sides are those of another object of the category, all scaled by at most 12 %, in a text: 'a mug 12.01 cm long and 9.40 cm
tall', 'a book, 21.30 x 14.50 x 2.80 cm'. Texts that cannot be made are refused; for the others the largest error of a side is
printed.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from manitwin.errors import UsageError
from manitwin.models.annotators.priors import load_priors
from manitwin.models.generators.lift.text_generation import make_from_text
from manitwin.models.generators.templates.catalog import load_templates

OTHER_SEED, MOST_LARGER = 77, 0.12


def main() -> None:
    """Make the templates and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--volume", default="400 ml")
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    refused: dict[int, list[str]] = {2: [], 3: []}
    off, costs = [0.0], []
    for category in load_templates():
        other = np.ptp(make_from_text(f"a {category}", OTHER_SEED)[0].mesh.vertices, axis=0)
        x, y, z = np.round(100 * other * np.exp(rng.uniform(-MOST_LARGER, MOST_LARGER)), 2)
        long, wide = max(x, y), min(x, y)
        for sides, text in (
            ([long, z], f"a {category} {long:.2f} cm long and {z:.2f} cm tall"),
            ([long, wide, z], f"a {category}, {long:.2f} x {wide:.2f} x {z:.2f} cm"),
        ):
            begun = time.process_time()
            try:
                extents = 100 * np.ptp(make_from_text(text, given.seed)[0].mesh.vertices, axis=0)
            except UsageError:
                refused[len(sides)].append(category)
                continue
            costs.append(time.process_time() - begun)
            off += [float(np.abs(extents / side - 1).min()) for side in sides]
    total = len(load_templates())
    for count, names in refused.items():
        print(f"{count} sides: {total - len(names)} of {total}; not {', '.join(names)}")
    print(f"a side is off by {max(off):.2%} at most; CPU-s: median {np.median(costs):.2f}, most {max(costs):.2f}")
    vessels = [name for name in load_templates() if load_priors()[name].vessel or load_priors()[name].container]
    held = 0
    for category in vessels:
        try:
            make_from_text(f"a {category} of {given.volume}", given.seed)
        except UsageError as error:
            print(error)
        else:
            held += 1
    print(f"{given.volume}: {held} of {len(vessels)} vessels")


if __name__ == "__main__":
    main()
