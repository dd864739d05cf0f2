"""Names that the priors relate to a template's category although the template has another shape."""

from __future__ import annotations

from collections.abc import Sequence

from manitwin.models.annotators.prior_names import singulars
from manitwin.models.generators.templates.look_phrases import is_descriptive
from manitwin.models.generators.templates.vocabulary import FILLER_WORDS


def _listed(names: str) -> frozenset[str]:
    """Return the names of a comma-separated list."""
    return frozenset(" ".join(names.split()).split(", "))


KIN_OF_ANOTHER_SHAPE = _listed(
    """
    kettlebell, muffin tin, cake pan, roasting pan, stone, pulley, bearing, gavel, toy hammer, set square, protractor,
    doorbell, potted plant, awl, file, poker chip, earring, plantain, lime, grapefruit, apricot, parsnip, radish,
    garlic, shallot, sweet potato, beetroot, turnip, leek, spring onion, squash, raspberry, blackberry, cracker, snack
    bar, basketball, volleyball, rugby ball, handball, cricket ball, squash ball, bocce ball, steel ball, bead,
    mahjong tile, rattle, teether, spinning top, fidget spinner, tractor, toy bus, toy truck, toy train, impact
    driver, pocket knife, multitool, vise, lint roller, garden fork, zester, corkscrew, scoop, nail, hacksaw, bar
    clamp, sieve, pocket watch, lantern, night light, security camera, action camera, infrared thermometer, insulin
    pen, trunk, briefcase, postcard, door handle, trophy, medal, safety pin, thumbtack, hairpin, book stand, chalk,
    ink bottle
    """
)
"""Categories that the priors relate to a template's, of another shape or look: a kettlebell is no dumbbell, a lime no lemon."""
_NAMES_OF_OTHERS = _listed(
    """
    cherry tomato, baguette, jenga block, alphabet block, cuboid, tile, disc, game piece, timber,
    plank, lumber, boot, high heel, sandal, slipper, clog, flip flop, pump shoe, high top, beanie, binder,
    ring binder, laptop charger, power supply, joystick, stand, fitness band, fitness tracker, card holder, tetra pak,
    button cell, coin cell, button cell battery, coin cell battery,
    coin battery, button battery
    """
)
"""Aliases of a template's category in the priors for objects that it does not make: a boot is no low shoe."""
_COMPOUNDS = _listed(
    """
    cookie cutter, biscuit cutter, glass cutter, pipe cutter, bolt cutter, tile cutter, cigar cutter, fried egg, scrambled
    egg, poached egg,
    ice cube, cube tray, sugar cube, stock cube, bouillon cube, black pepper,
    white pepper, cayenne pepper, candy corn, baby corn, hose clamp, pipe
    clamp, horse shoe, snow shoe, brake shoe, onion ring, boxing ring, piston ring,
    socket wrench, socket spanner, torque wrench, pipe wrench, strap wrench
    """
)
"""Compounds of a template's name that mean another object: a horse shoe is no shoe."""
_PART_NAMES = frozenset({"cap"})
"""Names that mean an object alone, but a part or cover after another noun: a bottle cap is not for a head."""


def is_of_another_shape(phrase: str, before: Sequence[str]) -> bool:
    """Return whether no template makes the named object, although the priors assign the name to a template's category."""
    said = {*singulars(phrase)}
    if before and any(f"{before[-1]} {each}" in _COMPOUNDS for each in (phrase, *singulars(phrase))):
        return True
    part = before and before[-1] not in FILLER_WORDS and not is_descriptive(before[-1])
    return not said.isdisjoint(_NAMES_OF_OTHERS) or bool(part and not said.isdisjoint(_PART_NAMES))
