"""Quality checks and messages on guessed names and sizes, and on templates filled in by a model."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any, cast

from manitwin.engine.stage import Draft
from manitwin.models.annotators.likely_names import OF_LIKELY_NAMES
from manitwin.models.annotators.prior_names import names_with, normalise_name
from manitwin.models.annotators.priors import load_priors
from manitwin.pipeline.human_corrections import SIZE, corrected_category, corrected_name
from manitwin.twin.record_values import Check

PRIOR = "prior:"
UNKNOWN = f"{PRIOR}unknown"
"""The source of values from the prior for any object."""
OF_NO_NAME = frozenset({UNKNOWN, OF_LIKELY_NAMES})
"""Sources that do not depend on a name: the generic prior, or a mixture over likely names."""

SIZE_UNSAID = "nobody says how large it is"
"""Text in a rejection's detail if the size is only a typical one; remedies look for it."""
OF_ANYTHING = "usual of anything"
"""Addition if the object is unnamed as well."""
LIKE_IT = " that looks like it"
"""Addition if a classifier has guesses."""
SPELT_ALIKE = 0.8
"""Similarity of two names (``difflib`` ratio) from which one may be a misspelling of the other."""
MOST_NAMES = 3
"""Number of known names shown that contain the given word."""


def naming_checks(draft: Draft) -> list[Check]:
    """Return the check on an unnamed object's name as guessed by a model or classifier; it passes if one is confident.

    For an input that a person has named later, it states who; empty for other inputs.
    """
    said = None if corrected_category(draft) is not None else corrected_name(draft)
    if said is not None:
        return [Check(name="named", passed=True, value=said.value, message=f"{said.source} says what it is")]
    naming = draft.fields.get("naming")
    if naming is None:
        return []
    filled, known = template_fill_note(draft), (draft.fields.get("generation") or {}).get("known")
    if filled is not None and filled["category"] is not None and known is not None:
        message = f"{filled['source']} takes it for a {known['name']}; --name overrules it"
        return [Check(name="named", passed=True, value=str(known["name"]), message=message)]
    value, source = naming["probability"]["value"], naming["probability"]["source"]
    if naming["name"] is not None:
        message = f"{source} takes it for a {naming['name']} ({likeliest_words(naming)}); --name overrules it"
    else:
        message = f"{source} cannot tell what it is ({likeliest_words(naming)}); say it with --name"
    return [Check(name="named", passed=naming["name"] is not None, value=value, message=message)]


def size_checks(draft: Draft) -> list[Check]:
    """Return the failed check of a size from the generic prior; empty if the size or name was stated.

    For an input whose size a person has stated later, a passed check that states who.
    """
    size, stated = draft.fields.get("size"), (draft.fields.get("geometry") or {}).get(SIZE)
    if stated is not None and size is None:
        message = f"{stated['source']} says how long it is: {100 * stated['value']:.4g} cm"
        return [Check(name="size_known", passed=True, value=stated["value"], message=message)]
    if size is None or size["source"] not in OF_NO_NAME:
        return []
    message = f"{SIZE_UNSAID}: {unknown_size_words(size)}, and its mass is for that size; say what it is with --name"
    return [Check(name="size_known", passed=False, value=size["value"], message=message)]


def unknown_size_words(size: dict[str, Any]) -> str:
    """Describe a size from a prior: '15 cm is what is usual of anything (2 to 60 cm)', or '... of a mug'."""
    value, low, high = (f"{100 * size[key]:.3g}" for key in ("value", "low", "high"))
    category = size["source"].removeprefix(PRIOR)
    usual = {UNKNOWN: OF_ANYTHING, OF_LIKELY_NAMES: OF_ANYTHING + LIKE_IT}.get(
        size["source"], f"usual of {'an' if category[0] in 'aeiou' else 'a'} {category}"
    )
    return f"{value} cm is what is {usual} ({low} to {high} cm)"


def typical_size_words(draft: Draft) -> str | None:
    """Describe that the size is only typical of such objects; None if it was stated."""
    size = draft.fields.get("size")
    if size is None or not size["source"].startswith(PRIOR):
        return None
    return f"{SIZE_UNSAID}: {unknown_size_words(size)}"


def unknown_name_words(name: str, remedy: str = "say what kind of thing it is with --name, in English") -> str:
    """Describe that a name is unknown to the priors, with known names that contain it or are spelt alike.

    ``remedy`` is appended if there are no such names.
    """
    known = sorted({word for prior in load_priors().values() for word in (prior.category, *prior.aliases)})
    near = names_with(name)[:MOST_NAMES] or get_close_matches(normalise_name(name), known, n=2, cutoff=SPELT_ALIKE)
    *others, last = map(repr, near) if near else ("",)
    meant = f"{', '.join(others)} or {last}" if others else last
    asked = f"; did you mean {meant}?" if near else f"; {remedy}"
    return f"the priors (docs/priors.md) know no {name!r}: mass and friction are those of any object{asked}"


def likeliest_words(naming: dict[str, Any]) -> str:
    """Describe the likeliest names with their probabilities: 'orange 41 %, lemon 12 %, apple 3 %'."""
    return ", ".join(f"{guess['name']} {100 * guess['probability']:.0f} %" for guess in naming["likeliest"])


def template_fill_note(draft: Draft) -> dict[str, Any] | None:
    """Return the generator's note on a template that a model filled in; None if there is none."""
    generation = draft.fields.get("generation") or {}
    return cast(dict[str, Any] | None, generation.get("notes", {}).get("filled"))


def template_checks(draft: Draft) -> list[Check]:
    """Return checks on how a template was filled in: by a model, else by the words of a text."""
    filled = template_fill_note(draft)
    return _unused_words_checks(draft) if filled is None else [_filled_check(filled)]


def _filled_check(filled: dict[str, Any]) -> Check:
    said = [] if filled["category"] is None else [f"{filled['source']} filled in the template {filled['category']}"]
    message = "; ".join([*said, *filled["findings"]])
    return Check(name="template_filled", passed=not filled["findings"], value=filled["category"], message=message)


def _unused_words_checks(draft: Draft) -> list[Check]:
    """Return the failed check of a text with words that its template does not use; empty for other inputs."""
    unused = (draft.fields.get("generation") or {}).get("notes", {}).get("unused_words", [])
    if not unused:
        return []
    message = f"the template knows nothing of {', '.join(map(repr, unused))}: the thing was made without"
    return [Check(name="text_understood", passed=False, value=float(len(unused)), message=message)]


def shape_checks(draft: Draft) -> list[Check]:
    """Return the failed check of a photo whose outline fits no template of its name; empty for other inputs.

    The name may be that of the contents (yogurt in a carton), or of one of several objects in the photo.
    """
    poor = (draft.fields.get("generation") or {}).get("notes", {}).get("poor_fit")
    if poor is None:
        return []
    category, overlap = poor["category"], poor["residual"]["iou"]
    message = (
        f"no {category} that the template makes has this outline (overlap {overlap:.2f}): the shape is the outline's, but mass,"
        f" uses and a size that nobody stated are those of a {category}; check the name, and that the photo shows one alone"
    )
    return [Check(name="shape_as_named", passed=False, value=overlap, message=message)]
