"""Priors adapted to a material stated in the name: a steel mug has the prior of a mug, but of steel.

The words are those of texts (``generators/templates/looks.py``). The usual masses are scaled with the material. Mass per
volume scales with the density, where a scan thickens thin walls more than thick ones. Mass at a given size scales with
density times the usual wall thickness of the materials (``prior_tables/materials.toml``); for objects that need not be walls,
with anything between that and the density alone.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from manitwin.errors import UsageError
from manitwin.models.annotators.diacritics import remove_diacritics
from manitwin.models.annotators.prior_names import found_by, singulars
from manitwin.models.annotators.prior_records import Interval, Prior
from manitwin.models.annotators.priors import load_materials
from manitwin.models.generators.templates.look_phrases import stated_materials
from manitwin.models.generators.templates.looks import MATERIAL_WORDING, MATERIALS, Look
from manitwin.models.generators.templates.matter import is_composite, is_food, looks_of_materials, surfaces_of

USUAL_WALL_M = 0.003
"""Wall thickness of open containers in materials that list none: silicone, cardboard, leather."""
OF_ONE_MATTER = 0.5
"""Ratio of bulk density to material density below which an object counts as hollow."""
IMITATION = (0.08, 0.4, 1.0)
"""Ratio of bulk density to material density for imitations of food, hollow or solid (YCB 010 to 018: 0.05 to 0.45)."""
_LIGHTEST_KG_M3 = 10.0


def prior_in_named_material(name: str | None) -> Prior | None:
    """Return the prior of an everyday name in the material that the name states; None if the name is unknown."""
    found = found_by(name)
    if found is None or name is None:
        return None
    prior, called = found
    look = _stated_look(name, called, prior)
    return prior if look is None else prior_in_material(prior, look)


def prior_in_material(prior: Prior, look: Look) -> Prior:
    """Return a prior in another material than usual; the prior itself if the material is the usual one.

    If such objects have parts of different materials, the first part, an unknown share of the mass, gets the new material.
    """
    said = MATERIAL_WORDING.get(look.material, look.material)
    if is_composite(prior):
        return prior if look.surface in surfaces_of(prior) else _with_part_material(prior, look, said)
    if prior.material == said:
        return prior
    mass_by, bulk = _mass_factors(prior, look)
    contact = load_materials()[look.surface]
    return prior.model_copy(
        update={
            "material": said,
            "surface": look.surface,
            "friction_static": contact.friction_static,
            "friction_dynamic": contact.friction_dynamic,
            "restitution": contact.restitution,
            "mass_kg": _times(prior.mass_kg, mass_by),
            "bulk_density_kg_m3": bulk,
            "stated": look.material,
            "part_materials": {},
        }
    )


def look_from_words(material: str | None) -> Look | None:
    """Return the look for a twin's material in words; None for several materials or an unknown one."""
    if material is None:
        return None
    of_words = {said: name for name, said in MATERIAL_WORDING.items()}
    return MATERIALS.get(of_words.get(material, material))


def _stated_look(name: str, called: str, prior: Prior) -> Look | None:
    """Return the material that a name states before, within or after the words for the object; None for none or several."""
    words = re.sub(
        r"[^a-z0-9,]+", " ", remove_diacritics(name).replace("\u2019", "").replace("'", "").replace(",", " , ")
    ).split()
    length = len(called.split())
    begins = [at for at in range(len(words)) if called in singulars(" ".join(words[at : at + length]))]
    if not begins:
        return None
    begin, end = begins[0], begins[0] + length
    try:
        said = stated_materials(words[:begin], words[begin:end], words[end:], prior)
    except UsageError:
        return None  # ambiguous, e.g. steel and wood
    return said[0] if len(set(said)) == 1 else None


def _mass_factors(prior: Prior, look: Look) -> tuple[tuple[float, float, float], Interval | None]:
    """Return the factors (low, typical, high) on the mass at a given size, and the bulk density."""
    usual, bulk = looks_of_materials(prior.material), prior.bulk_density_kg_m3
    if is_food(prior) and bulk is not None:
        low, typical, high = (share * look.density_kg_m3 for share in IMITATION)
        return (low / bulk.low, typical / bulk.typical, high / bulk.high), Interval(low=low, typical=typical, high=high)
    if not usual or prior.mass_distribution == "shell" or prior.domain == "electronics":
        return (1.0, 1.0, 1.0), bulk
    density = float(np.exp(np.mean([np.log(each.density_kg_m3) for each in usual])))
    wall_m = float(np.exp(np.mean([np.log(_wall_m(each)) for each in usual])))
    heavier, areal = look.density_kg_m3 / density, look.density_kg_m3 * _wall_m(look) / (density * wall_m)
    if _is_contents_dominated(prior, density):
        if bulk is None:
            return (1.0, 1.0, 1.0), None
        low = max(bulk.low * areal, min(bulk.low, _LIGHTEST_KG_M3))
        held = Interval(low=low, typical=bulk.typical + low - bulk.low, high=bulk.high + low - bulk.low)
        return (low / bulk.low, held.typical / bulk.typical, held.high / bulk.high), held
    swollen = None if bulk is None else _scan_bulk_density(bulk, density, look, wall_m)
    if prior.container:
        return (areal, areal, areal), swollen
    return (min(areal, heavier), float(np.sqrt(areal * heavier)), max(areal, heavier)), swollen


def _is_contents_dominated(prior: Prior, density_kg_m3: float) -> bool:
    """Tell whether the mass of such objects comes mostly from their contents instead of their material."""
    bulk = prior.bulk_density_kg_m3
    light = bulk is not None and bulk.typical < OF_ONE_MATTER * density_kg_m3
    return prior.vessel or (prior.mass_distribution == "full" and light)


def _scan_bulk_density(bulk: Interval, density_kg_m3: float, look: Look, wall_m: float) -> Interval:
    """Return the bulk density of scans in another material; a scan thickens thick walls relatively less."""
    ends = []
    for value in (bulk.low, bulk.typical, bulk.high):
        full = min(value / density_kg_m3, 1.0)
        ends.append(look.density_kg_m3 / (1 + (1 / full - 1) * wall_m / _wall_m(look)))
    matter = load_materials()[look.surface].density_kg_m3
    low, typical, high = np.array(ends) * [matter.low / matter.typical, 1.0, matter.high / matter.typical]
    return Interval(low=float(low), typical=float(typical), high=float(high))


def _with_part_material(prior: Prior, look: Look, said: str) -> Prior:
    """Return a prior of objects with parts of different materials, with another material for the first one."""
    first = looks_of_materials(re.split(r" and | with ", prior.material)[0])
    if not first or first[0].surface != prior.surface:
        return prior
    rest = re.split(r"(?= and | with )", prior.material, maxsplit=1)[1]
    density = float(np.exp(np.mean([np.log(each.density_kg_m3) for each in first])))
    by = look.density_kg_m3 / density
    spread = (min(by, 1.0), float(np.sqrt(by)), max(by, 1.0))
    bulk, contact = prior.bulk_density_kg_m3, load_materials()[look.surface]
    return prior.model_copy(
        update={
            "material": f"{said}{rest}",
            "surface": look.surface,
            "friction_static": contact.friction_static,
            "friction_dynamic": contact.friction_dynamic,
            "restitution": contact.restitution,
            "mass_kg": _times(prior.mass_kg, spread),
            "bulk_density_kg_m3": None if bulk is None else _times(bulk, spread),
            "stated": look.material,
            "part_materials": {},
        }
    )


def _wall_m(look: Look) -> float:
    walls = load_materials()[look.surface].wall_m
    return USUAL_WALL_M if walls is None else walls.typical


def _times(interval: Interval, by: Sequence[float]) -> Interval:
    ends = sorted(
        value * factor for value, factor in zip((interval.low, interval.typical, interval.high), by, strict=True)
    )
    low, typical, high = ends
    return Interval(low=low, typical=typical, high=high)
