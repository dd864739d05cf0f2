"""Phrases shared by questions: the name and the size of the object."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.models.annotators.protocol import Subject


def name_line(name: str | None, known_as: str | None = None) -> str:
    """Return the sentence with the user's name for the object, or the name that an earlier answer gave it."""
    if name:
        return f"The user calls it: {' '.join(name.split())}."
    if known_as:
        return f"The user has not said what it is; it was recognised as: {' '.join(known_as.split())}."
    return "The user has not said what it is."


def size_phrase(extents_m: np.ndarray) -> str:
    """Return extents ``(3,)`` in m as '11.7 x 8.8 x 8.1 cm', along the object's own axes, the last one its height."""
    return " x ".join(f"{100 * float(extent):.1f}" for extent in extents_m) + " cm (the last one is its height)"


def size_line(subject: Subject, extents_m: np.ndarray) -> str:
    """Return the sentence with the size, and whether it is measured or estimated."""
    if subject.size_estimated:
        return f"Its size was estimated from pictures, not measured: about {size_phrase(extents_m)}."
    return f"Its measured size is {size_phrase(extents_m)}."


def extents_of(parts: tuple[trimesh.Trimesh, ...]) -> np.ndarray:
    """Return the extents ``(3,)`` of all visual meshes together."""
    corners = np.array([part.bounds for part in parts])
    return corners[:, 1].max(0) - corners[:, 0].min(0)


def length_phrase(length_m: float) -> str:
    """Return a length in m as '80 mm'."""
    return f"{1000 * length_m:.0f} mm"
