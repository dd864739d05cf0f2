"""MAS rules: plausibility of the mass for shape, material and category."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from itertools import pairwise

from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.assets.audit.rules.scale import is_of_wrong_size
from manitwin.models.annotators.prior_records import HEAVIEST_CONTENTS_KG_M3
from manitwin.models.annotators.priors import load_materials

LEAST_WALL_M = {
    "plastic": 0.0002, "ceramic": 0.002, "glass": 0.0007, "steel": 0.0001, "aluminium": 0.0001, "wood": 0.0005,
    "cardboard": 0.0003, "paper": 0.00005, "rubber": 0.0001, "foam": 0.001, "textile": 0.0002, "leather": 0.0005,
    "food skin": 0.001, "wax": 0.001, "stone": 0.003, "unknown": 0.00005,
}  # fmt: skip
"""Thinnest walls of household objects by material, in round numbers of ours, on the thin side.

PET bottles 0.25 mm, drinks cans 0.1 mm, bone china 2 mm, light bulbs 0.7 mm, copy paper 0.1 mm and tissue half of that.
"""

OTHER_WORDS = {
    "porcelain": "ceramic", "china": "ceramic", "stoneware": "ceramic", "earthenware": "ceramic", "metal": "unknown",
    "aluminum": "aluminium", "iron": "steel", "wooden": "wood", "bamboo": "wood", "nylon": "plastic", "silicone": "rubber",
    "melamine": "plastic", "acrylic": "plastic", "cloth": "textile", "fabric": "textile", "cotton": "textile",
    "plush": "textile", "carton": "cardboard", "sponge": "foam",
}  # fmt: skip
"""Other names of the materials in the priors; metal may be any of them."""

HOLDS_NOTHING = frozenset({"foam", "textile", "wood", "wax", "food skin"})
"""Materials of which no package is made, so that their own density is the upper bound."""

SLACK = 1.25
"""Tolerance of the bounds on both sides: densities and scans are not exact."""

BEYOND_USUAL = 3.0
"""Factor by which a mass may be beyond the interval of nearly all (19 of 20) objects of the category."""

SIZE_SLACK = 1.5
"""A mass is compared with its category only if the size fits the category up to this factor."""


def missing(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a movable asset that declares no mass."""
    if measured.asset.inertial.mass_kg is None and not measured.asset.static:
        yield Complaint("no mass is declared: the simulator takes one of its own")


def not_positive(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a mass that is not a positive number."""
    mass = measured.asset.inertial.mass_kg
    if mass is not None and not (math.isfinite(mass) and mass > 0):
        yield Complaint(f"the mass is {mass:g} kg", values={"mass_kg": mass})


def positive_mass_kg(measured: MeasuredAsset) -> float | None:
    """Return the declared mass, None if there is none or it is not positive."""
    mass = measured.asset.inertial.mass_kg
    return mass if mass is not None and math.isfinite(mass) and mass > 0 else None


def named_materials(words: str) -> list[str]:
    """Return the materials of the priors that a text names, without duplicates."""
    known = load_materials()
    found = re.findall(r"[a-z]+", words)
    names = [OTHER_WORDS.get(word, word) for word in found] + [" ".join(pair) for pair in pairwise(found)]
    return [name for name in dict.fromkeys(names) if name in known]


def possible_mass_kg(measured: MeasuredAsset) -> tuple[float, float, str] | None:
    """Return the least and largest possible mass of this shape and material, and the name of the material.

    Hollow objects determine the least mass: half of the surface area (both sides of a wall) times the thinnest wall of the
    material, or the enclosed volume if that is smaller. The largest mass is that of the filled convex hull; for categories that
    are always denser than any package (dumbbells), that of the hull at their highest density, because the declared material is
    only their coating. None without a shape that has volume.
    """
    surface = measured.surface
    if surface is None or not len(measured.hull):
        return None
    names = named_materials(measured.material_words) or ["unknown"]
    materials = load_materials()
    hull_m3 = float(measured.hull.volumes_m3.sum())
    least, most = math.inf, 0.0
    for name in names:
        density = materials[name].density_kg_m3
        wall_m3 = surface.area_m2 / 2 * LEAST_WALL_M[name]
        matter_m3 = wall_m3 if surface.volume_m3 is None else min(wall_m3, surface.volume_m3)
        least = min(least, density.low * matter_m3)
        most = max(
            most, (density.high if name in HOLDS_NOTHING else max(density.high, HEAVIEST_CONTENTS_KG_M3)) * hull_m3
        )
    bulk = None if measured.prior is None else measured.prior.bulk_density_kg_m3
    if bulk is not None and bulk.low >= HEAVIEST_CONTENTS_KG_M3:
        most = max(most, bulk.high * hull_m3)
    what = "common matter" if names == ["unknown"] else " or ".join(names)
    return least / SLACK, most * SLACK, what


def against_volume(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a mass that is impossible for shape and material; silent if the size is wrong already."""
    mass = positive_mass_kg(measured)
    possible = None if mass is None or is_of_wrong_size(measured) else possible_mass_kg(measured)
    if mass is None or possible is None:
        return
    least, most, what = possible
    if not least <= mass <= most:
        hull = 1e6 * float(measured.hull.volumes_m3.sum())
        yield Complaint(
            f"{mass:.3g} kg, but a thing of {what} in this shape (hull {hull:.3g} cm3) has {least:.3g} to {most:.3g} kg",
            values={"mass_kg": mass, "least_kg": least, "most_kg": most},
        )


def against_category(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a mass far from nearly all objects of the category and size; silent if the mass is impossible for the volume."""
    mass, prior = positive_mass_kg(measured), measured.prior
    if mass is None or prior is None or measured.complaints(against_volume):
        return
    size, usual = prior.longest_axis_m, prior.mass_kg
    if not size.low / SIZE_SLACK <= measured.longest_m <= size.high * SIZE_SLACK:
        return
    if not usual.low / BEYOND_USUAL <= mass <= usual.high * BEYOND_USUAL:
        yield Complaint(
            f"{mass:.3g} kg, but nearly every {prior.category} has {usual.low:.3g} to {usual.high:.3g} kg",
            values={"mass_kg": mass, "usual_low_kg": usual.low, "usual_high_kg": usual.high},
        )


def counted_twice(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a mass that the format's engine increases, because it counts overlapping shapes twice."""
    declared, engine = positive_mass_kg(measured), measured.asset.inertial.engine_kg
    if declared is not None and engine is not None:
        yield Complaint(
            f"the file declares {declared:.3g} kg and is simulated with {engine:.3g} kg: a place is weighed twice",
            values={"mass_kg": declared, "engine_kg": engine},
        )


RULES = (
    Rule(
        "MAS001",
        "mass-missing",
        "warning",
        why="Without a mass every simulator invents one: SAPIEN and MuJoCo fill the collision shapes with 1000 kg/m3, RoboTwin"
        " takes 10 g for whatever it is (RoboTwin #508: a hammer of 10 g).",
        remedy="Declare the mass in kilograms; `manitwin build` estimates it with an interval and says from what.",
        check=missing,
    ),
    Rule(
        "MAS002",
        "mass-not-positive",
        "error",
        why="A body of zero mass cannot be simulated: loaders replace it without a word, or drop the body. RoboDojo #41: a"
        " hammer of 0 kg became one of 50 g.",
        remedy="Write the mass of the real thing in kilograms.",
        check=not_positive,
    ),
    Rule(
        "MAS003",
        "mass-against-volume",
        "error",
        why="A density of 100 kg/m3 for everything made a porcelain mug of 16 g (LIBERO #154, LIBERO-PRO #33); masses lost in"
        " conversion come back as density times a filled volume (urdf-usd-converter #145: 30 kg became 67 kg). The bounds"
        " know hollow things: the least is the thinnest wall that the declared material is used with over half of the"
        " surface, the most is the convex hull full of the material, or of the heaviest contents a package has;"
        " of things that are heavy inside whatever they are coated with (a dumbbell of rubber) it is the hull full of iron.",
        remedy="Correct the mass, the material or the scale: one of the three is wrong.",
        check=against_volume,
    ),
    Rule(
        "MAS004",
        "mass-against-category",
        "error",
        why="A mass may be possible for some matter and still be absurd for the thing: LIBERO's bowl weighs 5.6 g (LIBERO"
        " #154), RoboTwin's hammer 1 g (RoboTwin #508). The mass is held against that of nearly all such things (19 of 20,"
        " docs/priors.md) where the size is theirs too, and may be three times beyond.",
        remedy="Correct the mass, or the category where the thing is something else.",
        check=against_category,
    ),
    Rule(
        "MAS005",
        "mass-weighed-twice",
        "error",
        why="MuJoCo weighs every geom, and one that says no mass or density by 1000 kg/m3: where a file gives collision shapes"
        " a density and what is only seen none, each place counts twice. An apple of object_sim is declared with 0.41 kg and"
        " simulated with 0.74, a wine glass with 0.19 and 0.80.",
        remedy='Write mass="0" for the geoms that are only seen, or an <inertial> for the body.',
        check=counted_twice,
    ),
)
