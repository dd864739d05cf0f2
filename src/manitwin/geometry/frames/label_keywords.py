"""Keyword rules from labels of points to kinds of functional frames, e.g. 'rim' to opening, 'blade' to edge."""

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
"""Further meanings of a keyword: they are not searched for, but a frame of such a kind is not a contradiction."""
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


def frame_kinds_for_label(label: str) -> tuple[Kind, ...]:
    """Return the kinds of frame that fit a label, likeliest first; ``("surface",)`` if no keyword matches."""
    text = label.lower()
    for pattern, kinds in _KINDS:
        if re.search(pattern, text):
            return kinds
    return _UNSAID


def face_direction_for_label(label: str) -> np.ndarray | None:
    """Return the direction ``(3,)`` that a face with this label has in the upright pose; None if the label does not state one."""
    if _DOWN.search(label):
        return np.array([0.0, 0.0, -1.0])
    return np.array([0.0, 0.0, 1.0]) if _UPWARD.search(label) else None


def is_end_face_label(label: str) -> bool:
    """Return whether a face with this label is the end of a part, as the striking face of a hammer's head."""
    return _END_ON.search(label) is not None


def is_compatible_kind(label: str, kind: Kind) -> bool:
    """Return whether a kind of frame fits a label; any kind fits a label without keywords."""
    kinds = frame_kinds_for_label(label)
    also = {each for pattern, others in _ALSO if re.search(pattern, label.lower()) for each in others}
    return kinds is _UNSAID or kind in kinds or kind in also


def denotes_feature_itself(label: str, kind: Kind) -> bool:
    """Return whether a label denotes the feature of its frame itself, not a larger part that contains it."""
    if kind in ("surface", "axis") or _INSIDE.search(label):
        return False
    return frame_kinds_for_label(label)[0] == kind and _WHOLE.search(label) is None


def may_project_sideways(label: str) -> bool:
    """Return whether a part with this label may be the end of an object or project from its side, such as bristles."""
    return _AHEAD_OR_ASIDE.search(label) is not None


def is_pouring_label(label: str) -> bool:
    """Return whether the label of a tip means an outlet for pouring."""
    return _POURS.search(label) is not None


def is_aiming_label(label: str) -> bool:
    """Return whether a part with this label emits or looks in one direction (nozzle, muzzle, lens)."""
    return _AIMS.search(label) is not None


def grip_rank(label: str) -> int | None:
    """Return how likely an aimed tool is held at a part with this label: 0 for a trigger, larger is less likely; None: not held
    there.
    """
    return next((rank for rank, words in enumerate(_GRIPS) if re.search(words, label, re.IGNORECASE)), None)


def is_cutting_edge(category: str, label: str) -> bool:
    """Return whether an edge with this label on an object of this category cuts, as a knife's does but not a ruler's or
    spatula's.
    """
    return _CUTS.search(f"{category} {label}") is not None


def is_wiping_face(category: str, label: str) -> bool:
    """Return whether a face with this label wipes: any face of a sponge, or a face of another object labelled so."""
    return _WIPERS.search(category) is not None or _WIPES.search(label) is not None
