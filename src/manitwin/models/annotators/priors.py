"""The priors: a table of usual sizes, masses, parts and uses of things, keyed by what a person calls the thing.

The table is ``prior_tables/*.toml`` beside this module: ``materials.toml`` (friction, restitution), ``forms.toml`` (shape, parts
and how they are used, shared by many categories) and one file a domain with the categories. docs/priors.md says how it
was made.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from functools import cache
from importlib import resources
from itertools import combinations
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from manitwin.errors import ManiTwinError, choose_from
from manitwin.formats.toml_file import parse_toml
from manitwin.geometry.parts.features import Feature
from manitwin.geometry.parts.membership import PartRole, PartRule
from manitwin.geometry.parts.shape import HeadEnd, Shape
from manitwin.models.annotators.diacritics import without_diacritics
from manitwin.twin.point_records import GraspType
from manitwin.twin.record_values import Estimate, Finite, Record

TABLES = resources.files("manitwin.models.annotators") / "prior_tables"
VOCABULARY_FILES = ("materials", "forms")
"""The files of the folder that are not a domain."""

HEAVIEST_CONTENTS_KG_M3 = 2000.0
"""Closed packages hold no more: sugar, sand and shampoo in a jar are below."""

Distribution = Literal["full", "solid", "shell"]
"""Full of its contents or of one matter; solid: the mesh is the matter itself; shell: hollow behind a closed skin."""


DEVIATIONS_ACROSS = 3.29
"""Standard deviations between the ends of an interval that holds 90 % of a log-normal value."""
LEAST_LOG_SPREAD = 0.02


class Interval(Record):
    """A usual value and the interval that nearly all (about 19 of 20) such things are in."""

    low: Finite
    typical: Finite
    high: Finite

    @model_validator(mode="after")
    def _ordered(self) -> Interval:
        if not 0 <= self.low <= self.typical <= self.high:
            raise ValueError(f"not in order: {self.low}, {self.typical}, {self.high}")
        return self

    @property
    def log_spread(self) -> float:
        """The standard deviation of a value's natural logarithm, at least ``LEAST_LOG_SPREAD``."""
        return max(math.log(self.high / self.low) / DEVIATIONS_ACROSS, LEAST_LOG_SPREAD)

    def estimate(self, source: str) -> Estimate:
        """Return the typical value with the interval around it, said by ``source``."""
        return Estimate(value=self.typical, low=self.low, high=self.high, source=source)


def _interval_from_list(value: Any) -> Any:
    if isinstance(value, list) and len(value) == 3:
        return dict(zip(("low", "typical", "high"), value, strict=True))
    return value


LowTypicalHigh = Annotated[Interval, BeforeValidator(_interval_from_list)]


class FunctionalPart(Record):
    """A part with a use: ``feature`` says where it is, as geometry."""

    label: str
    description: str
    feature: Feature


class GraspPart(Record):
    """A place to hold such a thing, how, and for what."""

    type: GraspType
    scenario: str
    feature: Feature


class Material(Record):
    """Contact properties of a surface material; ``source`` says where they are from.

    ``wall_m`` is how thick walls of open ware are made of it; None where they are not.
    """

    friction_static: LowTypicalHigh
    friction_dynamic: LowTypicalHigh
    restitution: LowTypicalHigh
    density_kg_m3: LowTypicalHigh
    wall_m: LowTypicalHigh | None = None
    source: str


class Form(Record):
    """The shape, rest and parts that a family of categories shares; ``parts`` is the rule that tells them apart on a surface.

    ``level``: what stands has its long axis level, and is put on no end. ``often_stands``: laid down, but stands where its
    file has it so. ``opens_aside``: its openings are in its sides and not its top.
    ``vessel``: closed, and weighs what it holds: its bulk densities are from empty to full.
    """

    shape: str
    stands: bool | None = None
    level: bool = False
    often_stands: bool = False
    opens_aside: bool = False
    container: bool
    mass_distribution: Distribution
    vessel: bool = False
    wall_thickness_m: float | None = None
    head_end: HeadEnd = "wide"
    parts: PartRule | None = None
    functional: tuple[FunctionalPart, ...] = Field(min_length=2, max_length=4)
    grasp: tuple[GraspPart, ...] = Field(min_length=2, max_length=3)


class Places(Record):
    """What is where on a thing: the parts of ``Form`` that another form may have of it."""

    parts: PartRule | None
    functional: tuple[FunctionalPart, ...]
    grasp: tuple[GraspPart, ...]


class Prior(Form):
    """The usual values of one category of things.

    ``longest_axis_m`` is that of the oriented box. ``bulk_density_kg_m3`` is mass per volume of a repaired scan, not of
    the matter; None where a scan's volume says nothing of the mass. ``stands``: whether it is put down upright (None:
    either). ``like`` is the category whose numbers it has for want of its own, ``kin_of`` that whose form it has. ``counter``
    is what such things are counted by ('pair of'). ``part_materials`` are the materials of its parts by role, where they are
    of unlike matter. ``measured`` names the published measurements; ``sources`` says where the rest is from.
    ``with_handle`` are the places of such a thing from which a handle sticks out, where some have one, ``with_bail`` those of one
    that a handle goes over; ``stated`` is the material that somebody has said it is of.
    """

    category: str
    domain: str
    aliases: tuple[str, ...]
    longest_axis_m: LowTypicalHigh
    mass_kg: LowTypicalHigh
    bulk_density_kg_m3: LowTypicalHigh | None
    material: str
    surface: str
    friction_static: LowTypicalHigh
    friction_dynamic: LowTypicalHigh
    restitution: LowTypicalHigh
    function: str
    like: str | None = None
    kin_of: str | None = None
    counter: str | None = None
    part_materials: dict[PartRole, str] = Field(default_factory=dict)
    sources: tuple[str, ...] = Field(min_length=1)
    measured: tuple[str, ...]
    with_handle: Places | None = None
    with_bail: Places | None = None
    stated: str | None = None

    def of_shape(self, shape: Shape) -> Prior:
        """Return the prior with the places that a thing of this shape has: a tea cup or a basket may have a handle, or none."""
        handle = shape.side_handle
        if handle is None:
            return self
        places = self.with_handle if handle.bail is None else self.with_bail or self.with_handle
        return self if places is None else self.model_copy(update=dict(places))

    @property
    def source(self) -> str:
        """The source of its Estimates: whose numbers they are, and of which stated material: 'prior:mug of steel'."""
        return f"prior:{self.like or self.category}{f' of {self.stated}' if self.stated else ''}"


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


def _worded(parts: list[dict[str, Any]], category: str) -> list[dict[str, Any]]:
    """Put the category's name where a form's wording leaves room for it."""
    return [{key: value.replace("{object}", category) for key, value in part.items()} for part in parts]


def _prior(category: str, row: dict[str, Any], domain: str, defaults: dict[str, Any], forms: dict[str, Any]) -> Prior:
    materials = load_materials()
    row = {**defaults, **row}
    form_name, surface = row.pop("form"), row.pop("surface")
    if form_name not in forms:
        raise ManiTwinError(f"{domain}.toml [{category}]: {choose_from('form', form_name, forms)}")
    for material in row.get("part_materials", {}).values():
        if material not in materials:
            raise ManiTwinError(f"{domain}.toml [{category}]: {choose_from('part material', material, materials)}")
    if surface not in materials:
        raise ManiTwinError(f"{domain}.toml [{category}]: {choose_from('surface material', surface, materials)}")
    contact = materials[surface]
    merged = {
        "aliases": [], "measured": [], "bulk_density_kg_m3": None, "material": surface,
        "friction_static": contact.friction_static, "friction_dynamic": contact.friction_dynamic,
        "restitution": contact.restitution, **forms[form_name], **row,
    }  # fmt: skip
    if "functional" in row:
        merged["parts"] = row.get("parts")  # places of its own: the form's rule is of others
    for key in ("with_handle", "with_bail"):
        form = merged.pop(key, None)
        if form is not None and "functional" not in row:
            told = {each: _worded(forms[form][each], category) for each in ("functional", "grasp")}
            merged[key] = {"parts": forms[form]["parts"], **told}
    for key in ("functional", "grasp"):
        merged[key] = _worded(merged[key], category)
    return Prior.model_validate({**merged, "category": category, "domain": domain, "surface": surface})


@cache
def load_priors() -> dict[str, Prior]:
    """Return all priors by category; raises ManiTwinError or ValidationError where the table contradicts itself."""
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
                priors[name] = _prior(name, each, domain, defaults, forms)
    return priors


_NUMBERS = frozenset({"longest_axis_m", "mass_kg"})
"""With both of these an entry below another one has its own numbers, and borrows none."""


def _kin_row(category: str, row: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    """Return the row of a thing that is another one, but about as large and heavy: what it does not say is the category's."""
    said = {key: value for key, value in row.items() if key not in ("aliases", "measured", "sources")}
    borrowed = {} if own.keys() >= _NUMBERS else {"sources": [f"as a {category}"], "like": category}
    return {**said, **borrowed, **own, "kin_of": category}


@cache
def unknown_prior() -> Prior:
    """Return the prior of a thing nobody has named: wide intervals, source ``prior:unknown``."""
    return load_priors()["unknown"]


def normalised(name: str) -> str:
    """Return a name in lower-case Latin letters without marks, punctuation, articles and what follows a comma or bracket."""
    head = re.split(r"[,(\[;:]", without_diacritics(name), maxsplit=1)[0]
    words = re.sub(r"[^a-z0-9&+']+", " ", head.replace("’", "'").replace("'s ", " ").replace("'", "")).split()
    return " ".join(words[1:] if words[:1] in (["a"], ["an"], ["the"]) and len(words) > 1 else words)


def singulars(phrase: str) -> Iterator[str]:
    """Yield the phrase, and what its last word may be the plural of."""
    yield phrase
    for plural, singular in (("ives", "ife"), ("aves", "af"), ("ies", "y"), ("oes", "o"), ("s", ""), ("es", "")):
        if phrase.endswith(plural) and len(phrase) > len(plural) + 1:
            yield phrase.removesuffix(plural) + singular


@cache
def _index() -> dict[str, Prior]:
    index: dict[str, Prior] = {}
    for prior in load_priors().values():
        for name in (prior.category, *prior.aliases):
            key = normalised(name)
            if key in index:
                raise ManiTwinError(f"priors: {name!r} names both {index[key].category!r} and {prior.category!r}")
            index[key] = prior
    return index


def named(name: str) -> Prior | None:
    """Return the prior whose category or alias a name is, whole or in the plural; None where it is no such name."""
    index = _index()
    return next((index[phrase] for phrase in singulars(normalised(name)) if phrase in index), None)


def lookup(name: str | None) -> Prior | None:
    """Find the prior of what a person calls a thing; None where the table has no such thing (``found_by``)."""
    found = found_by(name)
    return None if found is None else found[0]


_MOST_WORDS_BEFORE = 6
_NO_THING = re.compile(
    r"[a-z]?\d+[a-z]?|[a-z]|black|white|gr[ae]y|silver|red|green|blue|yellow|orange|brown|pink|purple|beige|small|medium|large"
)


_IMITATIONS = {"toy": "toy", "plush": "stuffed toy", "stuffed": "stuffed toy"}
"""What a thing is of which one word says that it is made after another: a toy elephant is a toy."""


def found_by(name: str | None) -> tuple[Prior, str] | None:
    """Find the prior of what a person calls a thing, and the words, in the singular, by which it is found.

    Tried in order: the whole name, or an alias of it; the part before 'of', 'with', 'without', 'no', 'for', 'in', 'on' or 'from';
    the whole again: each as it is, in the singular, and with words dropped from the front ('red coffee mugs' are coffee mugs,
    which are mugs), and before its last word stands alone with words dropped between ('lego duplo brick' is a lego brick). The
    last word decides what a thing is: a mug rack is no mug. Where none is found, numbers and colours at
    the end say nothing ('mug_1' and 'pitcher blue' are a mug and a pitcher), and what is a toy of anything is a toy. File names
    are never looked up: they are not evidence.
    """
    if not name or not (phrase := normalised(name)):
        return None
    head = re.split(r" (?:made |full )?(?:of|with|for|in|on|without|no|from) ", phrase, maxsplit=1)[0].split()
    words = phrase.split()
    tries = [words, *(head[i:] for i in range(len(head) - 1)), *_words_dropped(head), head[-1:]]
    tries += [words[i:] for i in range(1, len(words))]
    while head and _NO_THING.fullmatch(head[-1]):
        head = head[:-1]
        tries += [head[i:] for i in range(len(head))]
    index = _index()
    for part in tries:
        for candidate in singulars(" ".join(part)):
            if candidate in index and index[candidate].category != "unknown":
                return index[candidate], candidate
    imitation = next((_IMITATIONS[word] for word in head[:-1] if word in _IMITATIONS), None)
    return None if imitation is None else (index[imitation], " ".join(head))


def _words_dropped(head: list[str]) -> Iterator[list[str]]:
    """Yield a name with words dropped between two that stay, the last of which is its noun; the most and the nearest first."""
    *before, noun = head
    if len(before) > _MOST_WORDS_BEFORE:
        return
    for kept in range(len(before) - 1, 0, -1):
        for places in reversed(list(combinations(range(len(before)), kept))):
            yield [*(before[place] for place in places), noun]


def word_for(prior: Prior, said: str) -> str:
    """Return what a person calls a thing that was found by these words: a 'coffee mug' is a mug, a 'pan' no frying pan.

    What it is sold in is called so where the words say only what is in it: 'ketchup' is a ketchup bottle.
    """
    words, category = said.split(), normalised(prior.category).split()
    if words[-len(category) :] == category:
        return prior.category
    whole = [name for name in (prior.category, *prior.aliases) if " of " not in name]
    packed = next((name for name in whole if normalised(name).startswith(f"{said} ")), None)
    if packed is not None:
        return packed
    return next((alias for alias in prior.aliases if normalised(alias) == said), said)  # a cook's knife as it is spelt
