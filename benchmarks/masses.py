"""Score estimated masses on templates, whose materials and masses are known, with and without their size.

    python benchmarks/masses.py [--seeds N]

Without the size each object is assumed to have the usual length of its category, as for a photo. Closed containers are left out,
because a template of one is empty while its prior includes the contents. An interval is meant to contain 90 % of the true masses.
"""

from __future__ import annotations

import argparse

import numpy as np
import trimesh

from manitwin.errors import ManiTwinError
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.protocol import Subject
from manitwin.models.annotators.rules import estimate_physical
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import ObjectDescription
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.twin.record_values import Estimate

FACTOR = 1.6


def main() -> None:
    """Print, with and without the size, the share of masses inside the interval, the width of intervals, and the misses."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=1)
    arguments = parser.parse_args()
    found: dict[str, list[tuple[Estimate, float]]] = {"size known": [], "size guessed": []}
    for category in sorted(load_templates()):
        for seed in range(arguments.seeds):
            made = made_thing(category, seed)
            if made is None:
                continue
            solid, true_kg = made
            for way, pairs in found.items():
                estimate = estimated(category, solid, metric=way == "size known")
                pairs.append((estimate, true_kg))
                if way == "size guessed" and not estimate.low <= true_kg <= estimate.high:
                    print(
                        f"{category:20s} {true_kg:.3f} kg, said {estimate.value:.3f} ({estimate.low:.3f} to {estimate.high:.3f})"
                    )
    for way, pairs in found.items():
        inside = sum(each.low <= true_kg <= each.high for each, true_kg in pairs)
        near = sum(max(each.value / true_kg, true_kg / each.value) <= FACTOR for each, true_kg in pairs)
        wide = np.median([each.high / each.low for each, _ in pairs])
        print(f"{way}: {inside} of {len(pairs)} inside, high over low {wide:.1f} in the median, {near} within {FACTOR}")


def made_thing(category: str, seed: int) -> tuple[trimesh.Trimesh, float] | None:
    """Return the closed mesh (m) and the mass (kg) of a template.

    Returns None for closed containers, and where the template cannot be made or has no prior.
    """
    prior = find_prior(category)
    if prior is None or prior.vessel:
        return None
    templates = load_templates()
    try:
        made = make_object(
            templates[category], ObjectDescription(category), np.random.default_rng([seed, *category.encode()])
        )
    except ManiTwinError:
        return None
    return trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False), sum(made.masses_kg.values())


def estimated(category: str, solid: trimesh.Trimesh, *, metric: bool) -> Estimate:
    """Return the mass that the rules estimate."""
    subject = Subject(name=category, solid=solid, parts=(), metric=metric, views=(), cameras=(), seed=0)
    mass = estimate_physical(subject, find_prior(category)).mass_kg
    assert mass is not None
    return mass


if __name__ == "__main__":
    main()
