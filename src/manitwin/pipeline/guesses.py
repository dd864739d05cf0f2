"""What a twin is guessed to be and how large: a classifier's or a model's word where nobody said it, as checks and in words."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any, cast

from manitwin.engine.stage import Draft
from manitwin.models.annotators.likely_names import OF_LIKELY_NAMES
from manitwin.models.annotators.prior_names import names_with, normalised
from manitwin.models.annotators.priors import load_priors
from manitwin.pipeline.human_corrections import SIZE, corrected_category, said_name
from manitwin.twin.record_values import Check

PRIOR = "prior:"
UNKNOWN = f"{PRIOR}unknown"
"""The source of what is only usual of anything."""
OF_NO_NAME = frozenset({UNKNOWN, OF_LIKELY_NAMES})
"""The sources of what rests on no name: of anything, or of the names that a thing may have."""

SIZE_UNSAID = "nobody says how large it is"
"""What a rejection's detail says where the size is only a usual one; remedies go by it."""
OF_ANYTHING = "usual of anything"
"""What it says besides where nobody has named the thing either."""
LIKE_IT = " that looks like it"
"""And what it adds where a classifier has guesses."""
SPELT_ALIKE = 0.8
"""Of two names, from where one may be meant by the other (``difflib``'s ratio)."""
MOST_NAMES = 3
"""Of those that a name is a word of, what is shown."""


def naming_checks(draft: Draft) -> list[Check]:
    """Return what a thing is taken for that nobody has named, by a model or a classifier: a finding, unless one is sure.

    Of an input that a person has named since who that was; none for others.
    """
    said = None if corrected_category(draft) is not None else said_name(draft)
    if said is not None:
        return [Check(name="named", passed=True, value=said.value, message=f"{said.source} says what it is")]
    naming = draft.fields.get("naming")
    if naming is None:
        return []
    filled, known = filled_in(draft), (draft.fields.get("generation") or {}).get("known")
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
    """Return the failed check of a size that is only what is usual of anything; none where somebody said it or what it is.

    Of an input whose size a person has stated since, who that was.
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
    """Say of a size that only a prior gives: '15 cm is what is usual of anything (2 to 60 cm)', or '... of a mug'."""
    value, low, high = (f"{100 * size[key]:.3g}" for key in ("value", "low", "high"))
    category = size["source"].removeprefix(PRIOR)
    usual = {UNKNOWN: OF_ANYTHING, OF_LIKELY_NAMES: OF_ANYTHING + LIKE_IT}.get(
        size["source"], f"usual of {'an' if category[0] in 'aeiou' else 'a'} {category}"
    )
    return f"{value} cm is what is {usual} ({low} to {high} cm)"


def unsaid_size_words(draft: Draft) -> str | None:
    """Say that a size is only what is usual of such things, so that nobody has said it; None where somebody has."""
    size = draft.fields.get("size")
    if size is None or not size["source"].startswith(PRIOR):
        return None
    return f"{SIZE_UNSAID}: {unknown_size_words(size)}"


def unknown_name_words(name: str, remedy: str = "say what kind of thing it is with --name, in English") -> str:
    """Say that a name is not among the priors', and the names that it is a word of, else those that are spelt like it.

    ``remedy`` ends it where there are no such names.
    """
    known = sorted({word for prior in load_priors().values() for word in (prior.category, *prior.aliases)})
    near = names_with(name)[:MOST_NAMES] or get_close_matches(normalised(name), known, n=2, cutoff=SPELT_ALIKE)
    *others, last = map(repr, near) if near else ("",)
    meant = f"{', '.join(others)} or {last}" if others else last
    asked = f"; did you mean {meant}?" if near else f"; {remedy}"
    return f"the priors (docs/priors.md) know no {name!r}: mass and friction are those of any object{asked}"


def likeliest_words(naming: dict[str, Any]) -> str:
    """Say the likeliest names with their probabilities: 'orange 41 %, lemon 12 %, apple 3 %'."""
    return ", ".join(f"{guess['name']} {100 * guess['probability']:.0f} %" for guess in naming["likeliest"])


def filled_in(draft: Draft) -> dict[str, Any] | None:
    """Return the note of what a model filled in; None where none was asked."""
    generation = draft.fields.get("generation") or {}
    return cast(dict[str, Any] | None, generation.get("notes", {}).get("filled"))


def template_checks(draft: Draft) -> list[Check]:
    """Return what is to be said of how a template was filled in: by a model, else by the words of a text."""
    filled = filled_in(draft)
    return _unused_words_checks(draft) if filled is None else [_filled_check(filled)]


def _filled_check(filled: dict[str, Any]) -> Check:
    said = [] if filled["category"] is None else [f"{filled['source']} filled in the template {filled['category']}"]
    message = "; ".join([*said, *filled["findings"]])
    return Check(name="template_filled", passed=not filled["findings"], value=filled["category"], message=message)


def _unused_words_checks(draft: Draft) -> list[Check]:
    """Return the failed check of a text with words that say nothing to its template; none for all others."""
    unused = (draft.fields.get("generation") or {}).get("notes", {}).get("unused_words", [])
    if not unused:
        return []
    message = f"the template knows nothing of {', '.join(map(repr, unused))}: the thing was made without"
    return [Check(name="text_understood", passed=False, value=float(len(unused)), message=message)]


def shape_checks(draft: Draft) -> list[Check]:
    """Return the failed check of a photo's thing whose outline no template of its name has; none for all others.

    Such a name may be that of what is in it (yogurt in a carton), or of one of several that the photo shows.
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
