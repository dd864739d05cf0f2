"""The priors: a table of usual sizes, masses, parts and uses of objects by category.

The table is ``prior_tables/*.toml`` beside this module: ``materials.toml`` (friction, restitution), ``forms.toml`` (shape,
parts and uses that categories share), ``languages.toml`` (names in other languages) and one file per domain with the
categories. docs/priors.md describes how it was made.
"""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import Any

from manitwin.errors import ManiTwinError, unknown_name_message
from manitwin.formats.toml_file import parse_toml
from manitwin.models.annotators.prior_records import Material, Prior

TABLES = resources.files("manitwin.models.annotators") / "prior_tables"
VOCABULARY_FILES = ("materials", "forms", "languages")
"""Files of the folder that are not domains."""


def _read(name: str) -> dict[str, Any]:
    path = TABLES / f"{name}.toml"
    return parse_toml(path.read_bytes(), f"{name}.toml", ManiTwinError)


def _domains() -> list[str]:
    names = (entry.name.removesuffix(".toml") for entry in TABLES.iterdir() if entry.name.endswith(".toml"))
    return sorted(name for name in names if name not in VOCABULARY_FILES)


@cache
def load_materials() -> dict[str, Material]:
    """Return the contact materials by name."""
    return {name: Material.model_validate(row) for name, row in _read("materials").items()}


def _insert_category(parts: list[dict[str, Any]], category: str) -> list[dict[str, Any]]:
    """Insert the category's name into the wording of a form."""
    return [{key: value.replace("{object}", category) for key, value in part.items()} for part in parts]


def _build_prior(
    category: str, row: dict[str, Any], domain: str, defaults: dict[str, Any], forms: dict[str, Any]
) -> Prior:
    """Build a prior from its row, the domain's defaults and its form; raises ManiTwinError for unknown names in the row."""
    materials = load_materials()
    row = {**defaults, **row}
    form_name, surface = row.pop("form"), row.pop("surface")
    if form_name not in forms:
        raise ManiTwinError(f"{domain}.toml [{category}]: {unknown_name_message('form', form_name, forms)}")
    for material in row.get("part_materials", {}).values():
        if material not in materials:
            raise ManiTwinError(
                f"{domain}.toml [{category}]: {unknown_name_message('part material', material, materials)}"
            )
    if surface not in materials:
        raise ManiTwinError(
            f"{domain}.toml [{category}]: {unknown_name_message('surface material', surface, materials)}"
        )
    contact = materials[surface]
    merged = {
        "aliases": [], "measured": [], "bulk_density_kg_m3": None, "material": surface,
        "friction_static": contact.friction_static, "friction_dynamic": contact.friction_dynamic,
        "restitution": contact.restitution, **forms[form_name], **row,
    }  # fmt: skip
    if "functional" in row:
        merged["parts"] = row.get("parts")  # the form's part rule does not apply to places of the category's own
    own = {place["label"]: place for place in row.get("functional", ())}
    for key in ("with_handle", "with_bail"):
        form = merged.pop(key, None)
        if form is not None and (not own or row.get("parts") == forms[form_name]["parts"]):
            places = [own.get(place["label"], place) for place in forms[form]["functional"]]
            told = {
                "functional": _insert_category(places, category),
                "grasp": _insert_category(forms[form]["grasp"], category),
            }
            merged[key] = {"parts": forms[form]["parts"], **told}
    for key in ("functional", "grasp"):
        merged[key] = _insert_category(merged[key], category)
    return Prior.model_validate({**merged, "category": category, "domain": domain, "surface": surface})


@cache
def load_priors() -> dict[str, Prior]:
    """Return all priors by category; raises ManiTwinError or ValidationError if the table is inconsistent."""
    forms = _read("forms")
    priors: dict[str, Prior] = {}
    for domain in _domains():
        table = _read(domain)
        defaults = table.pop("defaults", {})
        for category, row in table.items():
            kin = row.pop("kin", {})
            rows = {category: row} | {name: _kin_row(category, row, own) for name, own in kin.items()}
            for name, each in rows.items():
                if name in priors:
                    raise ManiTwinError(f"{domain}.toml [{name}]: is already in {priors[name].domain}.toml")
                priors[name] = _build_prior(name, each, domain, defaults, forms)
    return priors


_NUMBERS = frozenset({"longest_axis_m", "mass_kg"})
"""A kin entry with both of these has its own numbers and borrows none."""


def _kin_row(category: str, row: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    """Return the row of a kin category: values that it does not state are those of ``category``."""
    said = {key: value for key, value in row.items() if key not in ("aliases", "measured", "sources")}
    borrowed = {} if own.keys() >= _NUMBERS else {"sources": [f"as a {category}"], "like": category}
    return {**said, **borrowed, **own, "kin_of": category}


@cache
def load_names_abroad() -> dict[str, dict[str, list[str]]]:
    """Return names of categories in other languages, by category and language (ISO 639-1)."""
    return _read("languages")


@cache
def unknown_prior() -> Prior:
    """Return the prior of an unnamed object: wide intervals, source ``prior:unknown``."""
    return load_priors()["unknown"]
