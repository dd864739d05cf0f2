"""What the priors call by the name of a template's category, or keep with it, and the template does not look like."""

from __future__ import annotations

from collections.abc import Sequence

from manitwin.models.annotators.prior_names import singulars
from manitwin.models.generators.templates.described import is_described
from manitwin.models.generators.templates.vocabulary import FILLER_WORDS


def _listed(names: str) -> frozenset[str]:
    """Return names that are listed with commas between them."""
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
"""Kin in the priors of what a template makes, of another shape or look: a kettlebell is no dumbbell, a lime no lemon."""
_NAMES_OF_OTHERS = _listed(
    """
    cherry tomato, baguette, jenga block, alphabet block, cuboid, tile, disc, game piece, timber,
    plank, lumber, boot, high heel, sandal, slipper, clog, flip flop, pump shoe, high top, beanie, binder,
    ring binder, laptop charger, power supply, joystick, stand, fitness band, fitness tracker, card holder, tetra pak,
    button cell, coin cell, button cell battery, coin cell battery,
    coin battery, button battery
    """
)
"""Other names in the priors of a template's category, of what it does not make: a boot is no low shoe."""
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
"""A template's name behind a word that makes it another thing: a horse shoe is no shoe."""
_PARTS_TOO = frozenset({"cap"})
"""What names a thing alone, behind another noun names a part or a cover: a bottle cap is not for a head."""


def is_of_another_shape(phrase: str, before: Sequence[str]) -> bool:
    """Tell whether no template makes what is named, behind other words, though the priors have it as that of a category."""
    said = {*singulars(phrase)}
    if before and any(f"{before[-1]} {each}" in _COMPOUNDS for each in (phrase, *singulars(phrase))):
        return True
    part = before and before[-1] not in FILLER_WORDS and not is_described(before[-1])
    return not said.isdisjoint(_NAMES_OF_OTHERS) or bool(part and not said.isdisjoint(_PARTS_TOO))
