"""Volume of books and similar flat objects whose leaves are modelled one by one.

The mass belongs to the volume between the covers, not to the leaves of the mesh.
"""

from __future__ import annotations

import trimesh

from manitwin.geometry.boxes import oriented_bounding_box
from manitwin.models.annotators.prior_records import Prior

LEAST_BODIES = 6
"""Minimum number of bodies (two covers, a spine and a few leaves); an object of one or two bodies is one solid mesh."""
MOST_SHARE = 0.6
"""Maximum share of the hull's volume: a closed book that is one solid fills nearly all of it, thin leaves fill 0.1 to 0.33."""
LEAST_BOXY = 0.75
"""Minimum share of the hull in the oriented bounding box; the hull of an open book contains mostly air."""


def volume_with_leaves_m3(solid: trimesh.Trimesh, prior: Prior) -> float:
    """Return the volume of a solid, or that of its convex hull for a closed flat object of many separate leaves.

    This applies only to objects with a front, a back and edges (``faced``) that are full of one material: books, pads, packs
    of cards.
    """
    volume_m3 = float(solid.volume)
    if prior.parts != "faced" or prior.mass_distribution != "full":
        return volume_m3
    hull_m3 = float(solid.convex_hull.volume)
    if volume_m3 > MOST_SHARE * hull_m3 or solid.body_count < LEAST_BODIES:
        return volume_m3
    extents_m, _ = oriented_bounding_box(solid.vertices)
    return hull_m3 if hull_m3 >= LEAST_BOXY * float(extents_m.prod()) else volume_m3
