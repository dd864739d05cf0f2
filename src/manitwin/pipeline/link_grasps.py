"""Grasps restricted to one link of an articulated object with locked joints: both fingertips must touch it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import trimesh

from manitwin.engine.stage import Draft
from manitwin.errors import Rejected, unknown_name_message
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import sample_surface
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest, Screen, ScreenedProposals
from manitwin.pipeline.grasp_regions import PartedSolid, pad_opening_m
from manitwin.pipeline.links import face_links, read_articulation
from manitwin.pipeline.object_state import load_solid
from manitwin.robots.grippers.gripper import Gripper

ON_LINK = "on_link"
"""The filter's name in the counts of remaining proposals."""
FOCUS_POINTS = 64
"""Number of points on the link's surface around which proposals are denser."""


@dataclass(frozen=True)
class LinkScreen:
    """A screen that also requires contact with one link; ``surface`` is the solid with links as parts."""

    screen: Screen
    surface: PartedSolid
    link: str

    def __call__(self, raw: GraspProposals) -> ScreenedProposals:
        """Keep the proposals that pass the screen and whose fingertips both touch the link."""
        left = self.screen(raw)
        grasps = left.proposals
        contacts = self.surface.contacts(grasps.gripper_to_object, grasps.depth_m, grasps.width_m)
        on_link = np.flatnonzero((contacts.part == self.surface.part_ids.index(self.link)).all(axis=1))
        counts = {**left.counts, ON_LINK: len(on_link)}
        return replace(left, proposals=grasps.take(on_link), merits=left.merits.take(on_link), counts=counts)

    def why_none(self, counts: dict[str, int]) -> Rejected:
        """Explain why no proposal remained."""
        before = [count for name, count in counts.items() if name != ON_LINK]
        if not before or not before[-1]:
            return self.screen.why_none(counts)
        return Rejected(
            "no_proposal",
            f"none of {before[-1]} grasps that fit touches the link {self.link!r} with both fingertips; choose"
            f" another link, or leave out --link",
        )


@dataclass(frozen=True)
class ChosenLink:
    """The link to be grasped: the solid with the link of each face, and the link's name."""

    surface: PartedSolid
    link: str

    @classmethod
    def read(cls, draft: Draft, gripper: Gripper, link: str | None) -> ChosenLink | None:
        """Return the link with a name; None if none is requested. Raises Rejected if the object has no such link."""
        if link is None:
            return None
        articulation = read_articulation(draft)
        names = () if articulation is None else tuple(each.name for each in articulation.links)
        if articulation is None or link not in names:
            said = unknown_name_message("link", link, names) if names else f"no link {link!r}: it is one rigid body"
            raise Rejected("no_proposal", said, stage="grasps")
        solid = load_solid(draft.path("solid.npz"))
        labels = face_links(draft, articulation, solid)
        return cls(PartedSolid(solid, RayCaster(solid), labels, names, 0.0, pad_opening_m(gripper)), link)

    def focused(self, request: GraspRequest) -> GraspRequest:
        """Return the request with focus points all over the link instead of the selected points, few of which may lie on it."""
        faces = self.surface.labels == self.surface.part_ids.index(self.link)
        piece = trimesh.Trimesh(self.surface.solid.vertices, self.surface.solid.faces[faces], process=False)
        places, _, _ = sample_surface(piece, FOCUS_POINTS, np.random.default_rng(request.seed))
        return replace(request, focus_points_m=places)

    def screened(self, screen: Screen) -> LinkScreen:
        """Return a screen that also requires contact with the link."""
        return LinkScreen(screen, self.surface, self.link)
