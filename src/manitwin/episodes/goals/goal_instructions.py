"""Natural-language instructions of goals: templates by predicate, filled with names that distinguish the objects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import product

import numpy as np

from manitwin.episodes.goals.goal import Literal
from manitwin.episodes.naming import Name, category_names, names_of
from manitwin.errors import UsageError
from manitwin.models.annotators.prior_names import normalise_name
from manitwin.twin.record import Language

TEMPLATES: Mapping[str, tuple[str, ...]] = {
    "on": (
        "put {a} on {b}", "place {a} on top of {b}", "set {a} down on {b}", "{a} should be on {b}: put {it} there",
        "pick up {a} and put {it} on {b}", "take {a} and set {it} on {b}", "please stack {a} on {b}",
    ),
    "in": (
        "put {a} in {b}", "place {a} into {b}", "drop {a} into {b}", "pick up {a} and put {it} into {b}",
        "{a} should be in {b}: put {it} there", "please put {a} inside {b}", "take {a} and let {it} go in {b}",
    ),
    "left_of": (
        "put {a} to the left of {b}", "place {a} on the left side of {b}", "set {a} down left of {b}",
        "move {a} so that {they} {are} to the left of {b}", "{a} should be left of {b}: move {it} there",
        "pick up {a} and put {it} beside {b}, on the left",
    ),
    "right_of": (
        "put {a} to the right of {b}", "place {a} on the right side of {b}", "set {a} down right of {b}",
        "move {a} so that {they} {are} to the right of {b}", "{a} should be right of {b}: move {it} there",
        "pick up {a} and put {it} beside {b}, on the right",
    ),
    "behind": (
        "put {a} behind {b}", "place {a} at the back of {b}", "set {a} down behind {b}, as you see it",
        "move {a} so that {they} {are} behind {b}", "{a} should be behind {b}: move {it} there",
        "pick up {a} and put {it} farther away from you than {b}, just behind {it_b}",
    ),
    "in_front_of": (
        "put {a} in front of {b}", "place {a} before {b}", "set {a} down in front of {b}, as you see it",
        "move {a} so that {they} {are} in front of {b}", "{a} should be in front of {b}: move {it} there",
        "pick up {a} and put {it} between you and {b}, close to {it_b}",
    ),
    "near": (
        "put {a} near {b}", "place {a} next to {b}", "set {a} down close to {b}", "bring {a} to {b}",
        "{a} should be next to {b}: move {it} there", "pick up {a} and put {it} beside {b}",
    ),
    "away_from": (
        "move {a} away from {b}", "put {a} farther away from {b}", "set {a} down well clear of {b}",
        "take {a} and put {it} somewhere far from {b}", "{a} {are} too close to {b}: move {it} away",
        "pick up {a} and keep {it} apart from {b}",
    ),
    "upright": (
        "stand {a} up", "put {a} upright", "turn {a} the right way up and set {it} down", "set {a} back on {its} base",
        "pick up {a} and put {it} down upright", "please stand {a} upright again",
    ),
    "lifted": (
        "lift {a}", "pick up {a}", "take {a} and hold {it} up", "raise {a} off the table", "grasp {a} and lift {it}",
        "please hold {a} up",
    ),
    "hung": (
        "hang {a} on the peg", "hang up {a}", "put {a} on the hook", "pick up {a} and hang {it} on the peg",
        "take {a} and slip {it} over the peg", "please hang {a} up so that the peg goes through {it}",
    ),
    "inserted": (
        "put {a} into the holder", "insert {a} into the holder", "stand {a} up in the holder",
        "pick up {a} and put {it} into the holder", "slip {a} into the holder", "please put {a} away in the holder",
    ),
    "poured": (
        "pour what is in {a} into {b}", "empty {a} into {b}", "pour from {a} into {b}", "tip {a} out into {b}",
        "pick up {a}, pour it out into {b} and put {it} back", "please fill {b} with what is in {a}",
    ),
    "pushed_to": (
        "push {a} to the mark", "slide {a} over to the mark", "push {a} along until {they} {are} at the mark",
        "without lifting {it}, move {a} to the mark", "shove {a} over to the mark", "please push {a} to the marked place",
    ),
    "stirred": (
        "stir what is in {b} with {a}", "use {a} to stir {b}", "give {b} a stir with {a}", "stir around in {b} with {a}",
        "pick up {a} and stir what is in {b}", "please mix what {b} holds with {a}",
    ),
    "wiped": (
        "wipe the board with {a}", "clean the board with {a}", "take {a} and wipe over the board", "rub the board with {a}",
        "pick up {a} and wipe the middle of the board with {it}", "please give the board a wipe with {a}",
    ),
    "cut_motion": (
        "draw {a} along the middle of the board", "go through a cut on the board with {a}", "show a cut on the board with {a}",
        "pick up {a} and move {its} edge along the middle of the board", "make a cutting motion on the board with {a}",
        "please move {a} over the board as if to cut",
    ),
    "aimed": (
        "point {a} at {b}", "aim {a} at {b}", "direct {a} at {b}", "pick up {a} and point {it} at {b}",
        "take {a} and aim {it} at {b}", "please hold {a} so that {they} {point} at {b}",
    ),
    "handed_over": (
        "hand {a} over to the other arm", "give {a} to the other hand", "pass {a} from one hand to the other",
        "pick up {a} and hand {it} over", "take {a} with one arm and give {it} to the other one",
        "please pass {a} on to the other arm",
    ),
    "pressed": (
        "press {a}", "push down on {a} with your fingertips", "press down on {a}", "give {a} a push from above",
        "close your hand and press {a}", "please press {a} once",
    ),
    "struck": (
        "strike the block with {a}", "hit the block with {a}", "use {a} to strike the block",
        "pick up {a} and hit the block with {it}", "knock on the block with {a}", "please give the block a blow with {a}",
    ),
}  # fmt: skip
"""Templates of each predicate; the last one of each is held out for tests of policies (``held_out``)."""

FIXTURES: Mapping[str, frozenset[str]] = {
    "hung": frozenset({"peg", "hook"}),
    "inserted": frozenset({"holder"}),
    "struck": frozenset({"block"}),
    "wiped": frozenset({"board"}),
    "cut_motion": frozenset({"board"}),
    "pushed_to": frozenset({"mark"}),
}
"""What the templates call the things that stand there for a goal and are none of the objects."""


def is_fixture_unambiguous(predicate: str, others: Iterable[str]) -> bool:
    """Tell whether what a goal's words call its fixture is none of the other objects, by their categories.

    Beside a cutting board nobody knows which one "the board" is, nor beside a pen holder "the holder".
    """
    nouns = FIXTURES.get(predicate, frozenset())
    return not any(nouns & category_names(normalise_name(category)) for category in others)


def goal_instructions(
    literal: Literal,
    words: Mapping[str, Language],
    *,
    seed: int,
    count: int = 6,
    held_out: bool = False,
    joined: bool = False,
) -> tuple[str, ...]:
    """Return up to ``count`` different English instructions for one literal.

    ``words`` maps all objects in the scene to their language: an ambiguous name is used only if no name distinguishes the
    object. ``held_out``: use only the template that is otherwise never used. ``joined``: use only imperative templates, which can
    follow ``and then``; a statement (``{a} should be on {b}``) cannot. Deterministic for equal arguments. Raises UsageError for a
    predicate without templates.
    """
    if literal.predicate not in TEMPLATES:
        raise UsageError(f"no instructions for {literal.predicate!r}; there are some for {', '.join(TEMPLATES)}")
    templates = TEMPLATES[literal.predicate]
    templates = templates[-1:] if held_out else templates[:-1]
    if joined:
        templates = tuple(each for each in templates if not each.startswith("{"))
    subjects = _names(literal.subject, words)
    seconds = [None] if literal.second not in words else _names(str(literal.second), words)  # fixtures have no names
    rng = np.random.default_rng(seed)
    pairs = list(product(subjects, seconds))
    templates = tuple(templates[i] for i in rng.permutation(len(templates)))
    pairs = [pairs[i] for i in rng.permutation(len(pairs))]
    said: dict[str, None] = {}
    for round_number in range(len(pairs)):
        for place, template in enumerate(templates):
            subject, second = pairs[(place + round_number) % len(pairs)]
            said[_filled(template, subject, second)] = None
            if len(said) == count:
                return tuple(said)
    return tuple(said)


def _names(name: str, words: Mapping[str, Language]) -> list[Name]:
    others: Sequence[Language] = [language for other, language in words.items() if other != name]
    return names_of(words[name], others)


def _filled(template: str, subject: Name, second: Name | None) -> str:
    return template.format(
        a=f"the {subject.words}",
        b="" if second is None else f"the {second.words}",
        it="them" if subject.plural else "it",
        they="they" if subject.plural else "it",
        are="are" if subject.plural else "is",
        point="point" if subject.plural else "points",
        its="their" if subject.plural else "its",
        it_b="them" if second is not None and second.plural else "it",
    )
