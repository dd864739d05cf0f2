"""The templates: builders, a module a family, and ``templates.toml`` with their measures, looks and names."""

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
)  # fmt: skip


@cache
def load_templates() -> dict[str, Template]:
    """Return all templates by category, sorted; raises ManiTwinError where table and builders contradict each other."""
    for family in FAMILIES:
        import_module(f"{__name__}.{family}")
    rows = parse_toml((resources.files(__name__) / "templates.toml").read_bytes(), "templates.toml", ManiTwinError)
    if rows.keys() != BUILDERS.keys():
        raise ManiTwinError(f"templates.toml: builder or row missing: {sorted(rows.keys() ^ BUILDERS.keys())}")
    return {category: _template(category, rows[category], BUILDERS[category]) for category in sorted(rows)}


def _template(category: str, row: dict[str, Any], build: Builder) -> Template:
    wanted, given = set(signature(build).parameters), set(row["measures"])
    if wanted != given:
        raise ManiTwinError(
            f"templates.toml [{category}]: measures that are not its builder's: {sorted(wanted ^ given)}"
        )
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
        any_proportions=row.get("any_proportions", False),
    )


def _unit(name: str) -> Literal["m", ""]:
    return "m" if name.endswith("_m") else ""
