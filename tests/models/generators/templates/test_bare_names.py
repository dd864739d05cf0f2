"""Words that mean a template's thing where no other noun is said with them."""

from __future__ import annotations

import pytest
from told_templates import TEMPLATES, made_of, read, whole

from manitwin.errors import UsageError
from manitwin.models.annotators.prior_names import find_prior, named, prior_by_compound


@pytest.mark.parametrize(
    ("text", "category"),
    [
        ("king", "chess king"),
        ("a white king 9 cm tall", "chess king"),
        ("the queen with a red base", "chess queen"),
        ("a black knight made of ebony", "chess knight"),
        ("a small bishop", "chess bishop"),
        ("a wooden bishop", "chess bishop"),
        ("king, ebony", "chess king"),
    ],
)
def test_bare_name_means_one_thing(text: str, category: str) -> None:
    assert read(text).category == category


@pytest.mark.parametrize(
    "text",
    [
        "drama king", "burger king", "king size bed", "king size", "a queen size mattress", "queen bee", "knight rider",
        "two kings", "a leather king", "a red block",
    ],
)  # fmt: skip
def test_bare_name_beside_another_noun_or_of_another_material_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match=r"no template makes|several things"):
        read(text)


def test_what_is_said_of_a_bare_name_holds() -> None:
    assert whole("a red king").rgb == whole("a red chess king").rgb is not None
    assert made_of("a white king").category == "chess king"


def test_bare_names_are_no_names_of_other_things() -> None:
    """A name of the priors or of a template that a bare one took would never be reached by it."""
    names = {name for template in TEMPLATES.values() for name in (template.category, *template.names)}
    bare = [name for template in TEMPLATES.values() for name in template.bare]
    assert bare and len(set(bare)) == len(bare)
    assert not any(name in names or named(name) is not None for name in bare)


def test_name_written_as_one_word_is_the_same() -> None:
    assert read("a brass doorknob").category == "door knob" == read("a brass door knob").category
    found = prior_by_compound("doorknobs")
    assert found is not None and found is find_prior("door knob") and prior_by_compound("door") is None


def test_ice_cube_tray_is_no_tray_to_serve_on() -> None:
    with pytest.raises(UsageError, match="no template makes"):
        read("an ice cube tray")
