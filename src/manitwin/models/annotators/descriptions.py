"""Descriptions of an object in words: colour and size as measured, the rest from its prior and its shape."""

from __future__ import annotations

import re

import numpy as np

from manitwin.geometry.cavity import find_opening
from manitwin.geometry.parts.overall_shape import overall_shape
from manitwin.models.annotators.prior_names import counter_phrase, found_by, normalise_name, object_noun
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.annotators.protocol import Subject
from manitwin.models.annotators.surface_color import UNTEXTURED, ColorShare, measure_colors
from manitwin.twin.record import Language

UNKNOWN_FUNCTION = "unknown function (no name given that the priors know)"

# upper limits of the longest side (m)
_SIZE_WORDS = ((0.03, "tiny"), (0.10, "palm-sized"), (0.20, "hand-sized"), (0.35, "medium-sized"), (np.inf, "large"))

_A_NOT_AN = (
    "uk",
    "uni",
    "usb",
    "use",
    "ute",
    "eu",
    "one",
    "once",
)  # starts with a vowel in writing but a consonant in speech
_LETTERS_FROM_A_VOWEL = "efhilmnorsx"
"""Single letters whose names start with a vowel: an s hook, but a u joint."""
_AN_NOT_A = ("hour", "honest", "heir", "mp3", "x-ray")
_SINGULAR_ENDS = ("ss", "us", "is", "as", "os", "lens", "series")
_SHORTEST_PLURAL = 3
_NO_SINGLE_THING = frozenset(
    {"cutlery", "stationery", "furniture", "equipment", "clothing", "rice", "sand", "gravel", "food", "trash"}
)
_METALS = frozenset(
    (
        "metal",
        "steel",
        "iron",
        "aluminium",
        "brass",
        "bronze",
        "copper",
        "silver",
        "gold",
        "pewter",
        "tin",
        "titanium",
        "zinc",
    )
)
_ROUND = frozenset({"cylindrical", "round"})
_MADE_OF = {"wooden": "wood", "woollen": "wool", "golden": "gold", "metallic": "metal", "earthen": "clay"}


def article(phrase: str) -> str:
    """Return 'a' or 'an', as the first sound of a phrase requires."""
    first = phrase.lower()
    letter = re.match(r"([a-z])(?![a-z0-9'])", first)
    if letter is not None and letter[1] != "a":  # the phrase starts with an article: 'a mug'
        return "an" if letter[1] in _LETTERS_FROM_A_VOWEL else "a"
    if first.startswith(_AN_NOT_A) or (first[:1] in "aeiou" and not first.startswith(_A_NOT_AN)):
        return "an"
    return "a"


def _takes_no_article(noun: str) -> bool:
    """Tell whether an unknown noun is a plural or uncountable: kitchen utensils, tableware."""
    last = noun.split()[-1]
    plural = last.endswith("s") and len(last) > _SHORTEST_PLURAL and not last.endswith(_SINGULAR_ENDS)
    return plural or last in _NO_SINGLE_THING or (last.endswith("ware") and last != "ware")


def joined(words: list[str]) -> str:
    """Join words as in a sentence: 'red', 'red and blue', 'red, blue and white'."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def size_words(extents_m: np.ndarray) -> str:
    """Return extents ``(3,)`` in m as '21 x 16 x 7 cm, medium-sized', the longest first."""
    longest, second, shortest = sorted((100 * float(e) for e in extents_m), reverse=True)
    digits = 0 if shortest >= 3 else 1
    numbers = " x ".join(f"{value:.{digits}f}" for value in (longest, second, shortest))
    return f"{numbers} cm, {next(word for limit, word in _SIZE_WORDS if longest / 100 < limit)}"


def describe(subject: Subject, prior: Prior | None, material: str, extents_m: np.ndarray) -> Language:
    """Describe an object; without a ``prior`` (unnamed object) the texts say that it is unknown."""
    rng = np.random.default_rng(subject.seed)
    own_colors = None if subject.light is None else subject.light.object_colors
    colors = measure_colors(
        subject.parts, rng, own_colors, metal_in_a_photo=subject.photographed and is_metal(material)
    )
    shape = _shape(subject, prior, rng)
    size = size_words(extents_m)
    category = _category(subject, prior)
    captions = write_captions(category, prior, material, _color_words(colors), shape, size)
    return Language(
        category=category,
        color=_color(colors),
        material=material,
        size=size,
        shape=shape,
        function=prior.function if prior is not None else UNKNOWN_FUNCTION,
        caption=captions[0],
        captions=captions,
    )


def is_metal(material: str) -> bool:
    """Tell whether a material in words is metal only."""
    return all(matter.split()[-1] in _METALS for matter in re.split(r", | and | or | with ", material) if matter)


def _category(subject: Subject, prior: Prior | None) -> str:
    """Return the noun for the object: a 'coffee mug' is a mug, but a 'skillet' stays one and a 'pan' is not a frying pan."""
    found = found_by(subject.name)
    if prior is None or found is None:
        return normalise_name(subject.name) or "unknown" if subject.name else "unknown"
    return object_noun(prior, found[1])


def _color(colors: list[ColorShare]) -> str:
    if not colors:
        return UNTEXTURED
    if len(colors) == 1:
        return colors[0].name
    return ", ".join(f"{color.name} ({100 * color.share:.0f} %)" for color in colors)


def _color_words(colors: list[ColorShare]) -> str:
    return joined([color.name for color in colors]) if colors else ""


def _shape(subject: Subject, prior: Prior | None, rng: np.random.Generator) -> str:
    """Return the shape in words: the prior's, refined or corrected by the measured shape."""
    measured = overall_shape(subject.solid, rng)
    if prior is not None:
        proportion = measured.proportion
        said = prior.shape.lower()
        if measured.is_box and _ROUND & set(re.findall(r"\w+", said)):
            return (
                measured.word
            )  # the prior's shape contradicts the geometry: most speakers are cylinders, this one is a box
        return prior.shape if proportion == "compact" or proportion in said else f"{prior.shape}, {proportion}"
    opening = find_opening(subject.solid)
    return f"{measured.word} and hollow, open at one side" if opening is not None else measured.word


def _names_material(noun: str, material: str) -> bool:
    """Tell whether a noun already states the material: a glass bottle, a wooden spoon, a bar of soap."""
    words = {_MADE_OF.get(word, word) for word in noun.lower().split()}
    return material.lower() in words


def _capitalised(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]


def write_captions(category: str, prior: Prior | None, material: str, color: str, shape: str, size: str) -> list[str]:
    """Return captions of different length, style and content, a full sentence first; ``color`` may be empty (unknown).

    Each caption uses another combination of colour, material, dimensions, size word, shape and use.
    """
    noun = "object" if category == "unknown" else category
    counter = None if prior is None else counter_phrase(prior, noun)
    noun = noun if counter is None else f"{counter} {noun}"
    colored = f"{color} {noun}".strip()
    numbers, size_word = size.split(", ")
    one = "" if prior is None and _takes_no_article(noun) else f"{article(colored)} "
    of_size = f"{size_word} {noun}" if one == "" else f"{article(size_word)} {size_word} {noun}"
    edible = prior is not None and prior.surface == "food skin"
    untold = edible or material.startswith("unknown") or _names_material(noun, material)
    made_of = "" if untold else f" made of {material}"
    use = f", used for {prior.function}" if prior is not None else ""
    captions = [
        f"{_capitalised(one + colored)}{made_of}, about {numbers} in size{use}.",
        f"{one}{colored}",
        f"{_capitalised(of_size)} ({shape}).",
        f"It measures {numbers}.",
        f"Pick up the {noun}{made_of}." if made_of else f"Pick up the {size_word} {noun}.",
    ]
    if color:
        captions.append(f"Its shape: {shape}. Its color: {color}.")
    if prior is not None:
        captions.append(f"I need something for {prior.function}.")
        captions.append(
            f"Something {size_word} for {prior.function}{',' + made_of if made_of else ''}: {article(noun)} {noun}."
        )
    return captions
