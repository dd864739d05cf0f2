"""A template with specified values: category, measures, and colours and materials of parts."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from manitwin.errors import UsageError
from manitwin.geometry.solids.shapes import SolidError
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import ObjectDescription, read_text
from manitwin.models.generators.templates.fitting.fit import TemplateFit
from manitwin.models.generators.templates.look_phrases import LookRequest
from manitwin.models.generators.templates.looks import SHADES, apply_shade, color_of
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.models.generators.templates.stated_lengths import lengths_in
from manitwin.models.generators.templates.template import Template
from manitwin.models.generators.templates.template_object import TemplateObject

_HEX = re.compile(r"#([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})")


@dataclass(frozen=True)
class FilledTemplate:
    """A template's category with specified measures (metres and ratios), and wishes by part or slot.

    Measures that are not specified are sampled or fitted as usual.
    """

    category: str
    measures: Mapping[str, float] = field(default_factory=dict)
    wishes: Mapping[str, LookRequest] = field(default_factory=dict)

    @property
    def template(self) -> Template:
        """The template."""
        return load_templates()[self.category]

    def merged_with(self, other: FilledTemplate) -> FilledTemplate:
        """Return this with the values of another one added or replaced."""
        return replace(
            self, measures={**self.measures, **other.measures}, wishes=_merge_requests(self.wishes, other.wishes)
        )

    def solid_error(self) -> str | None:
        """Return why the measures, completed by typical values, give no solid; None if they do."""
        try:
            self.template.build(**self.template.typical_measures() | dict(self.measures)).assembly.mesh()
        except SolidError as error:
            return str(error)
        return None


def assignable_parts(template: Template) -> list[str]:
    """Return the names to which colours and materials can be assigned: the template's slots, and the parts of the
    typical object.
    """
    names = template.build(**template.typical_measures()).assembly.mesh().names
    return list(dict.fromkeys([*template.slots, *names]))


def parse_color(text: str) -> tuple[float, float, float] | None:
    """Return the sRGB colour of a word (blue), of two (dark blue) or of #rrggbb; None if it is no colour."""
    found = _HEX.fullmatch(text.strip())
    if found is not None:
        red, green, blue = (int(found[channel], 16) / 255 for channel in (1, 2, 3))
        return red, green, blue
    whole = color_of(" ".join(text.lower().split()))
    if whole is not None:
        return whole
    *shade, word = text.lower().split() or [""]
    color = color_of(word)
    if color is None or len(shade) > 1 or (shade and shade[0] not in SHADES):
        return None
    return apply_shade(color, shade[0]) if shade else color


def replace_looks(fitted: TemplateFit, wishes: Mapping[str, LookRequest]) -> TemplateFit:
    """Return a fitted object with other looks, for parts that a photo does not show."""
    made, template = fitted.made, load_templates()[fitted.category]
    first, model = next(iter(template.slots)), template.build(**template.typical_measures())
    looks = dict(made.looks)
    for part, look in made.looks.items():
        slot = model.slots.get(part, "") or first
        for said in ([""] if slot == first else []) + [slot, part]:
            look = wishes.get(said, LookRequest()).apply_to(look)
        looks[part] = look
    return replace(fitted, made=replace(made, looks=looks))


def make_filled(filled: FilledTemplate, text: str, rng: np.random.Generator) -> TemplateObject:
    """Make the object of a text with specified values; colours, materials and lengths stated in the text take precedence.

    Raises UsageError for an impossible size, and SolidError for measures that give no solid.
    """
    lengths = lengths_in(text)
    wanted = ObjectDescription(filled.category, filled.wishes, lengths)
    try:
        plain = read_text(text, load_templates())
    except UsageError:
        plain = wanted
    if plain.category == filled.category:
        known = {*filled.template.slots, "", *assignable_parts(filled.template)}
        said = {part: wish for part, wish in plain.wishes.items() if part in known and wish != LookRequest()}
        wanted = replace(
            plain,
            wishes=_merge_requests(filled.wishes, said),
            relative=None if plain.lengths_m else plain.relative,
        )
    return make_object(filled.template, wanted, rng, filled.measures)


def _merge_requests(wishes: Mapping[str, LookRequest], later: Mapping[str, LookRequest]) -> dict[str, LookRequest]:
    return {**wishes, **{part: wish.completed_by(wishes.get(part, LookRequest())) for part, wish in later.items()}}
