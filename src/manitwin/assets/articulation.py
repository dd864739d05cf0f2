"""What an asset's joints hold together: rigid links, and the joints between them that a twin can have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from manitwin.assets.inertial import Inertial
from manitwin.geometry.articulation import ArticulatedJoint
from manitwin.twin.link_records import MAX_LINKS


@dataclass(frozen=True)
class AssetLink:
    """A rigid link; what fixed joints hold together is one. ``inertial`` is in the asset's axes, as the links stand."""

    name: str
    inertial: Inertial


@dataclass(frozen=True)
class Articulation:
    """The links of an asset, the root first, and the joints between them, in the asset's axes.

    ``link_of_visual`` is the link of each of the asset's visual parts.
    """

    links: tuple[AssetLink, ...]
    joints: tuple[ArticulatedJoint, ...]
    link_of_visual: tuple[int, ...]


@dataclass(frozen=True)
class Node:
    """One body of a file's tree: ``holder`` is its place in the order, None of the first.

    ``joint`` is what lets it move (its ends are not said yet), None where nothing does or it cannot be kept; ``cause`` then says
    why, empty for what is fixed.
    """

    name: str
    holder: int | None
    shaped: bool
    joint: ArticulatedJoint | None = None
    cause: str = ""


@dataclass(frozen=True)
class Tree:
    """``link_of (N,)`` is the link of each node, ``heads`` the first node of each link, ``remarks`` what was not kept and why."""

    link_of: tuple[int, ...]
    heads: tuple[int, ...]
    joints: tuple[ArticulatedJoint, ...]
    remarks: tuple[str, ...]


def rigid_links(nodes: Sequence[Node]) -> Tree:
    """Return the links that nodes, holders first, make: each with a shape, all but the first held by a joint that is kept.

    A joint that cannot be kept is locked as it stands, and said so: those of other kinds, of links without a shape, of more
    than ``MAX_LINKS`` links. What holds a single link and has no shape is part of it, and its joint is left out.
    """
    remarks = [
        f"joint {node.cause}: it is locked as the file stands" for node in nodes if node.joint is None and node.cause
    ]
    kept = {place for place, node in enumerate(nodes) if node.joint is not None}
    while True:
        head_of = _heads(nodes, kept)
        shaped = {head_of[place] for place, node in enumerate(nodes) if node.shaped}
        bare = sorted(set(head_of) - shaped)
        if not bare or not kept:
            break
        if bare[0]:
            remarks.append(f"joint {_named(nodes, bare[0])} holds what has no shape: it is locked as the file stands")
            kept.discard(bare[0])
            continue
        first = [place for place in sorted(kept) if head_of[nodes[place].holder or 0] == 0]
        how = "is left out" if len(first) == 1 else "is locked as the file stands"
        remarks += [f"joint {_named(nodes, place)} hangs from what has no shape: it {how}" for place in first]
        kept -= set(first)
    if len(kept) >= MAX_LINKS:
        remarks.append(f"{len(kept)} joints were locked as the file stands: a twin has {MAX_LINKS} links at most")
        kept = set()
    head_of = _heads(nodes, kept)
    heads = (0, *sorted(kept))
    place_of = {head: place for place, head in enumerate(heads)}
    link_of = tuple(place_of[head] for head in head_of)
    joints = tuple(
        replace(joint, parent=link_of[nodes[head].holder or 0], child=place_of[head])
        for head in heads[1:]
        if (joint := nodes[head].joint) is not None
    )
    return Tree(link_of, heads, joints, tuple(remarks))


def _heads(nodes: Sequence[Node], kept: set[int]) -> list[int]:
    heads: list[int] = []
    for place, node in enumerate(nodes):
        heads.append(place if place in kept or node.holder is None else heads[node.holder])
    return heads


def _named(nodes: Sequence[Node], place: int) -> str:
    joint = nodes[place].joint
    return repr("" if joint is None else joint.name[:60])
