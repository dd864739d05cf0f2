"""Templates of categories: one module of builder functions per family, with a table of dimensions, looks and names beside it.

A row of a table (``vessels.toml`` beside ``vessels.py``) describes one template. Its fields are:

- the category, which is one of the priors', and the other names of the object;
- the looks of each slot to draw from, as 'colour material'; '' means the look of the first slot;
- the mean density of a closed container including its contents;
- the parts that are hollow sheet if they are of metal (``of_sheet``);
- the dimensions as [low, typical, high]: the interval that contains nearly all objects of the category.

A dimension whose name ends in ``_m`` is in metres, any other is a ratio. ``wall_m`` holds for ceramic; other materials have their
own wall thickness (``looks``), except metal if the object is ``of_plate``. A length without a direction refers to the whole
object, or to the part ``length_of``. An object with ``any_proportions`` takes length, width and height from a text unchanged,
others stay near their dimensions. An object with ``any_front`` has no side that is its front. An object that is ``told_in_full``
is not meant by the last word of its name alone, but in a text also by its ``bare`` names if they occur without another noun. The
dimensions are typical retail sizes; ``docs/templates.md`` describes how they were checked.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module, resources
from inspect import signature
from typing import Any, Literal

from manitwin.errors import ManiTwinError
from manitwin.formats.toml_file import parse_toml
from manitwin.models.generators.templates.template import BUILDERS, Builder, Measure, Template

FAMILIES = (
    "vessels", "pots", "bottles", "cutlery", "hand_tools", "hardware", "devices", "desk", "toiletries", "household",
    "food", "groceries", "balls", "toys",
    "cutting_tools", "workshop", "kitchen_tools", "cookware",
    "computing", "instruments", "appliances", "packages", "accessories", "clothing", "stationery", "homeware",
    "drinkware", "cosmetics", "batteries", "blocks", "chess_pieces", "clamps", "presses", "vegetables", "plastic_bottles",
    "fruit", "roots", "bakery", "snacks", "sports", "flat_goods", "tableware", "bakeware", "fittings", "shop_tools", "packs",
    "keepsakes", "small_goods", "home_goods", "kitchen_smalls", "small_foods",
    "toy_vehicles", "playthings",
)  # fmt: skip


@cache
def load_templates() -> dict[str, Template]:
    """Return all templates by category, sorted.

    Raises ManiTwinError if a table and its builders contradict each other.
    """
    templates: dict[str, Template] = {}
    for family in FAMILIES:
        module, file = f"{__name__}.{family}", f"{family}.toml"
        import_module(module)
        builders = {category: build for category, build in BUILDERS.items() if build.__module__ == module}
        rows = parse_toml((resources.files(__name__) / file).read_bytes(), file, ManiTwinError)
        if rows.keys() != builders.keys():
            raise ManiTwinError(f"{file}: builder or row missing: {sorted(rows.keys() ^ builders.keys())}")
        templates |= {category: _template(category, rows[category], builders[category]) for category in rows}
    return dict(sorted(templates.items()))


def _template(category: str, row: dict[str, Any], build: Builder) -> Template:
    wanted, given = set(signature(build).parameters), set(row["measures"])
    if wanted != given:
        raise ManiTwinError(f"template {category!r}: measures that are not its builder's: {sorted(wanted ^ given)}")
    measures = {
        name: Measure(low, typical, high, _unit(name)) for name, (low, typical, high) in row["measures"].items()
    }
    slots = {name: tuple(looks) for name, looks in row["slots"].items()}
    names, of_sheet = tuple(row.get("names", ())), tuple(row.get("of_sheet", ()))
    contents, of_plate = row.get("contents_kg_m3", {}), row.get("of_plate", False)
    return Template(
        category,
        row["group"],
        measures,
        slots,
        build,
        names,
        contents,
        of_sheet,
        of_plate,
        length_of=row.get("length_of", ""),
        diagonal_of=row.get("diagonal_of", ""),
        nominal=tuple(row.get("nominal", ())),
        nominal_times=row.get("nominal_times", 1.0),
        any_proportions=row.get("any_proportions", False),
        any_front=row.get("any_front", False),
        told_in_full=row.get("told_in_full", False),
        bare=tuple(row.get("bare", ())),
    )


def _unit(name: str) -> Literal["m", ""]:
    return "m" if name.endswith("_m") else ""
