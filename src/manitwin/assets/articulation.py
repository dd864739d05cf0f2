"""Links and joints of an asset: reduction of a file's body tree to rigid links joined by supported joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from manitwin.assets.inertial import Inertial
from manitwin.geometry.articulation import ArticulatedJoint
from manitwin.twin.link_records import MAX_LINKS


@dataclass(frozen=True)
class AssetLink:
    """A rigid link, with all bodies that fixed joints connect merged into it.

    ``inertial`` is in the asset's axes, with the links in the pose of the file.
    """

    name: str
    inertial: Inertial


@dataclass(frozen=True)
class Articulation:
    """The links of an asset, root first, and the joints between them, in the asset's axes.

    ``link_of_visual`` gives the index of the link for each visual part of the asset.
    """

    links: tuple[AssetLink, ...]
    joints: tuple[ArticulatedJoint, ...]
    link_of_visual: tuple[int, ...]


@dataclass(frozen=True)
class BodyNode:
    """One body in the tree of a file.

    ``holder`` is the index of the parent body in the node order, None for the root. ``shaped`` says whether the body has a
    shape. ``joint`` is the joint to the parent, with parent and child links not yet set. It is None where the body is fixed to
    its parent or where its joint is not supported; ``cause`` then gives the reason, and is empty for a fixed body.
    """

    name: str
    holder: int | None
    shaped: bool
    joint: ArticulatedJoint | None = None
    cause: str = ""


@dataclass(frozen=True)
class LinkTree:
    """The links and joints of a node tree.

    ``link_of (N,)`` is the link index of each node, ``heads`` the first node of each link, and ``remarks`` one line for each
    joint that was not kept, with the reason.
    """

    link_of: tuple[int, ...]
    heads: tuple[int, ...]
    joints: tuple[ArticulatedJoint, ...]
    remarks: tuple[str, ...]


def build_link_tree(nodes: Sequence[BodyNode]) -> LinkTree:
    """Merge nodes, parents first, into links: each link has a shape, and each but the first hangs from a joint that is kept.

    A joint that cannot be kept is locked in the pose of the file, with a remark. This applies to unsupported kinds, to joints
    whose child has no shape, and to all joints where there would be more than ``MAX_LINKS`` links. If the root has no shape, a
    single joint to it is dropped and the child merged into the root; several are locked.
    """
    remarks = [
        f"joint {node.cause}: it is locked as the file stands" for node in nodes if node.joint is None and node.cause
    ]
    kept = {place for place, node in enumerate(nodes) if node.joint is not None}
    while True:
        head_of = _first_nodes(nodes, kept)
        shaped = {head_of[place] for place, node in enumerate(nodes) if node.shaped}
        bare = sorted(set(head_of) - shaped)
        if not bare or not kept:
            break
        if bare[0]:
            remarks.append(
                f"joint {_joint_name(nodes, bare[0])} holds what has no shape: it is locked as the file stands"
            )
            kept.discard(bare[0])
            continue
        first = [place for place in sorted(kept) if head_of[nodes[place].holder or 0] == 0]
        how = "is left out" if len(first) == 1 else "is locked as the file stands"
        remarks += [f"joint {_joint_name(nodes, place)} hangs from what has no shape: it {how}" for place in first]
        kept -= set(first)
    if len(kept) >= MAX_LINKS:
        remarks.append(f"{len(kept)} joints were locked as the file stands: a twin has {MAX_LINKS} links at most")
        kept = set()
    head_of = _first_nodes(nodes, kept)
    heads = (0, *sorted(kept))
    place_of = {head: place for place, head in enumerate(heads)}
    link_of = tuple(place_of[head] for head in head_of)
    joints = tuple(
        replace(joint, parent=link_of[nodes[head].holder or 0], child=place_of[head])
        for head in heads[1:]
        if (joint := nodes[head].joint) is not None
    )
    return LinkTree(link_of, heads, joints, tuple(remarks))


def _first_nodes(nodes: Sequence[BodyNode], kept: set[int]) -> list[int]:
    heads: list[int] = []
    for place, node in enumerate(nodes):
        heads.append(place if place in kept or node.holder is None else heads[node.holder])
    return heads


def _joint_name(nodes: Sequence[BodyNode], place: int) -> str:
    joint = nodes[place].joint
    return repr("" if joint is None else joint.name[:60])
