"""Compare estimated centres of mass with those of templates, whose parts and materials are known by construction.

    python benchmarks/center_of_mass.py [--seeds N] [--held-out]

Each object is built with the appearance that its template draws, so its handle may have another material than the prior assumes.
The estimate is given only the mesh and the name. ``uniform`` assumes a solid of constant density; ``by parts`` uses the materials
of the prior where the shape shows the parts. Both columns are the distance (mm) to the true centre of mass. The categories are
split into the halves of ``points.py``; no parameter was set with either half.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import trimesh
from points import held_out

from manitwin.geometry.mass_properties import solid_mass_properties
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.ground_truth import mass_properties
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.pipeline.mass_by_parts import mass_by_parts


def main() -> None:
    """Print a line for each object, then the medians and the largest distances."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--held-out", action="store_true")
    arguments = parser.parse_args()
    rows, untold, started = [], 0, time.process_time()
    for category in sorted(load_templates()):
        prior = find_prior(category)
        if prior is None or not prior.part_materials or held_out(category) != arguments.held_out:
            continue
        for seed in range(arguments.seeds):
            found = distances_mm(category, seed)
            untold += found is None
            if found is not None:
                rows.append(found)
                print(f"{category:18s} uniform {found[0]:6.1f}   by parts {found[1]:6.1f}", flush=True)
    if not rows:
        return
    table = np.array(rows)
    better = int((table[:, 1] < table[:, 0]).sum())
    uniform, by_parts = np.median(table, axis=0)
    worst = table.max(axis=0)
    seconds = (time.process_time() - started) / (len(rows) + untold)
    print(f"{len(rows)} things, {untold} whose form shows no parts; {better} nearer by parts; {seconds:.2f} CPU-s each")
    print(f"median uniform {uniform:.1f} mm, by parts {by_parts:.1f} mm; largest {worst[0]:.0f} and {worst[1]:.0f} mm")


def distances_mm(category: str, seed: int) -> tuple[float, float] | None:
    """Return the distances (mm) of both estimates to the true centre, or None where no parts can be recognised."""
    templates, prior = load_templates(), find_prior(category)
    assert prior is not None
    made = make_object(templates[category], read_text(category, templates), np.random.default_rng(seed))
    solid = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
    mass_kg, center_m, _ = mass_properties(made.solids)
    materials = {str(role): material for role, material in prior.part_materials.items()}
    told = mass_by_parts(solid, mass_kg, materials, prior, seed)
    if told is None:
        return None
    uniform = solid_mass_properties(solid, mass_kg).center_of_mass_m
    off = [1000 * float(np.linalg.norm(center - center_m)) for center in (uniform, told.center_of_mass_m)]
    return off[0], off[1]


if __name__ == "__main__":
    main()
