"""Which kinds of frame the word for a place may have: 'rim' an opening, 'blade' an edge."""

from __future__ import annotations

import re

import numpy as np

from manitwin.geometry.frames.feature import Kind

_KINDS: tuple[tuple[str, tuple[Kind, ...]], ...] = (
    (r"button|switch|trigger|\bkeys?\b|knob|dial|wheel|space bar|pump head|pushbutton|lever|bump", ("button", "surface")),
    (r"flap|\blid\b|\bcap\b|stopper|\bupper\b", ("face", "surface")),
    (r"spout|nozzle|\bnose\b|tip\b|tips\b|\bpoint\b|tines?|prongs?|claw|wick|pole\b|plug|\bend\b|corner|needle|bit\b", ("tip",)),
    (r"finger|\bhole|holes\b|\bbore\b|\bcore\b|socket|keyhole|\beye\b|\bring\b|\bloops?\b|\bbow\b|inner side", ("hole",)),
    (r"opening|mouth|\brim\b|inside|interior|cavity|hollow|basin|pour|\blip\b|outlet", ("opening",)),
    (r"edge|blade|teeth|cutter|serration", ("edge",)),
    (r"\bfeet\b|\bpaws?\b", ("tip", "face", "surface")),
    (r"\blegs?\b|\btoe\b", ("tip", "surface")),
    (
        r"striking|face\b|base\b|bottom|underside|\bfoot\b|sole|screen|display|lens|cover|panel|front|back\b|\btop\b"
        r"|surface|flat|label|scourer|scouring|glass|cone\b|spine|picture|mirror|anvil",
        ("face", "surface"),
    ),
    (r"jaws?\b|bristles|wires", ("tip", "face", "surface")),
    (r"bowl|scoop|cup\b", ("opening", "surface")),
    (r"handle|grip|shaft|stem|barrel|shank|\brod\b|stick|temple|\barm\b|\bneck\b", ("axis", "hole", "surface")),
)  # fmt: skip
_ALSO: tuple[tuple[str, tuple[Kind, ...]], ...] = (
    (r"mouth|\bjaws?\b", ("tip", "hole")),
    (r"\blip\b", ("edge",)),
    (r"blade|base\b|bristles", ("tip", "face")),
    (r"\bbow\b", ("face",)),
    (r"\barm\b|\bneck\b", ("button",)),
    (r"spout|nozzle", ("opening", "hole")),
)
"""What a word may mean of some things besides: not looked for by it, but no contradiction."""
_UNSAID: tuple[Kind, ...] = ("surface",)
_DOWN = re.compile(r"base\b|bottom|underside|\bfoot\b|\bfeet\b|\bpaws?\b|sole", re.IGNORECASE)
_POURS = re.compile(r"spout|pour", re.IGNORECASE)
_AIMS = re.compile(r"nozzle|sprayer|outlet|muzzle|\blens\b|scan|\bbeam", re.IGNORECASE)
_GRIPS = (r"trigger", r"grip", r"handle|\bbody\b")
_CUTS = re.compile(r"(?<!putty )knife|cleaver|scalpel|cutting|\bblades?\b", re.IGNORECASE)
_WIPES = re.compile(r"wip(e|ing)|scour|scrub|bristles", re.IGNORECASE)
_WIPERS = re.compile(r"sponge|eraser|cloth\b|towel|duster|\bsoap\b(?! (dispenser|bottle|dish))", re.IGNORECASE)
_WHOLE = re.compile(
    r"bristles|jaws?\b|wires|\bfeet\b|\blegs?\b|\bpaws?\b|\btoe\b|\bend\b|base\b|bottom|underside|\bfoot\b|sole|front|back\b|\btop\b|upper|surface|flap|\blid\b|\bcap\b",
    re.IGNORECASE,
)
_AHEAD_OR_ASIDE = re.compile(r"bristles", re.IGNORECASE)
_INSIDE = re.compile(r"inside|interior|cavity|hollow|basin|bowl|scoop|cooking", re.IGNORECASE)
_END_ON = re.compile(r"striking|strike|hit|pound", re.IGNORECASE)
_UPWARD = re.compile(r"\btop\b|upper", re.IGNORECASE)


def kinds_for(label: str) -> tuple[Kind, ...]:
    """Return the kinds of frame that fit a label, the likeliest first; a place of the surface for words that say none."""
    text = label.lower()
    for pattern, kinds in _KINDS:
        if re.search(pattern, text):
            return kinds
    return _UNSAID


def direction_for(label: str) -> np.ndarray | None:
    """Return the direction ``(3,)`` in which a face of that name looks in the upright pose, None where the word says none."""
    if _DOWN.search(label):
        return np.array([0.0, 0.0, -1.0])
    return np.array([0.0, 0.0, 1.0]) if _UPWARD.search(label) else None


def is_end(label: str) -> bool:
    """Tell whether a face of that name is the end of something, as a striking face is that of a head."""
    return _END_ON.search(label) is not None


def fits(label: str, kind: Kind) -> bool:
    """Tell whether a kind of frame fits a label; to words that say no kind, any does."""
    kinds = kinds_for(label)
    also = {each for pattern, others in _ALSO if re.search(pattern, label.lower()) for each in others}
    return kinds is _UNSAID or kind in kinds or kind in also


def means_place(label: str, kind: Kind) -> bool:
    """Tell whether a label means the feature that its frame is of, and not something larger that the feature belongs to."""
    if kind in ("surface", "axis") or _INSIDE.search(label):
        return False
    return kinds_for(label)[0] == kind and _WHOLE.search(label) is None


def ahead_or_aside(label: str) -> bool:
    """Tell whether a part of that name is the end of a thing or stands out of its side, as bristles do."""
    return _AHEAD_OR_ASIDE.search(label) is not None


def pours(label: str) -> bool:
    """Tell whether the word for a tip means what is poured over."""
    return _POURS.search(label) is not None


def aims(label: str) -> bool:
    """Tell whether something comes out of a place of that name in one direction, or looks out of it."""
    return _AIMS.search(label) is not None


def grip_rank(label: str) -> int | None:
    """Return how near a place of that name is to where a thing that is aimed is held: 0 a trigger; None: not at all."""
    return next((rank for rank, words in enumerate(_GRIPS) if re.search(words, label, re.IGNORECASE)), None)


def cuts(category: str, label: str) -> bool:
    """Tell whether the edge of that name of such a thing is one that cuts: a knife's, not a ruler's or a spatula's."""
    return _CUTS.search(f"{category} {label}") is not None


def wipes(category: str, label: str) -> bool:
    """Tell whether the face of that name of such a thing wipes: a sponge's any, of other things that which is called so."""
    return _WIPERS.search(category) is not None or _WIPES.search(label) is not None
