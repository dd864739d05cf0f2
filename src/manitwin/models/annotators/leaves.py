"""Flat things whose leaves are each modelled: what a book weighs lies between its covers, and not in the leaves of its mesh."""

from __future__ import annotations

import trimesh

from manitwin.geometry.boxes import oriented_bounding_box
from manitwin.models.annotators.prior_records import Prior

LEAST_BODIES = 6
"""Two covers, a spine and a few leaves: a thing of one or two pieces is one whole mesh."""
MOST_SHARE = 0.6
"""Of the hull: a closed book that is one solid fills nearly all of it, one of a few dozen thin leaves a tenth to a third."""
LEAST_BOXY = 0.75
"""Of the box around it: an open book's hull holds mostly air."""


def volume_with_leaves_m3(solid: trimesh.Trimesh, prior: Prior) -> float:
    """Return the volume of a solid, or that of its hull where it is a closed flat thing of many separate leaves.

    Only of things with a front, a back and an edge that are full of one matter (``faced``): books, pads, packs of cards.
    """
    volume_m3 = float(solid.volume)
    if prior.parts != "faced" or prior.mass_distribution != "full":
        return volume_m3
    hull_m3 = float(solid.convex_hull.volume)
    if volume_m3 > MOST_SHARE * hull_m3 or solid.body_count < LEAST_BODIES:
        return volume_m3
    extents_m, _ = oriented_bounding_box(solid.vertices)
    return hull_m3 if hull_m3 >= LEAST_BOXY * float(extents_m.prod()) else volume_m3
