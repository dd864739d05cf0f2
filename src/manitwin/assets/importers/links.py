"""Links and joints of an imported asset, with checks of their mass properties."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydantic import ValidationError

from manitwin.assets.articulation import AssetLink
from manitwin.assets.asset import Asset
from manitwin.errors import AssetError
from manitwin.geometry.poses import transform_points
from manitwin.twin.link_records import Articulation, GivenLink, Joint

_ROUNDING = 1e-4  # of the largest moment, as for a whole asset: files often hold six digits
_UNSEEN = 4.0  # times the maximum of the mass within its visual mesh: unseen matter may lie twice as far out


def given_articulation(asset: Asset, to_object: np.ndarray) -> tuple[Articulation | None, list[str]]:
    """Return links and joints in the object frame (None for a rigid asset), and what was dropped, each with its reason.

    A link keeps mass, centre of mass and inertia only if all three are declared and possible for a rigid body. An inertia that
    its mass could not have within the visual mesh is dropped. Raises AssetError for a link without visual geometry, for example
    because its mesh is missing.
    """
    found = asset.articulation
    if found is None:
        return None, []
    shown = [link for link, part in zip(found.link_of_visual, asset.visual, strict=True) if len(part.faces)]
    names = _distinct([link.name for link in found.links])
    bare = [name for place, name in enumerate(names) if place not in shown]
    if bare:
        lacks = f" ({asset.missing_files[0]} is missing)" if asset.missing_files else ""
        raise AssetError(
            f"{asset.path.name}: link {bare[0][:60]!r} moves and shows nothing{lacks}; give its mesh, or take what can be seen"
            " with --lock-joints"
        )
    joint_names = _distinct([joint.name for joint in found.joints])
    joints = [replace(joint.moved(to_object), name=name) for joint, name in zip(found.joints, joint_names, strict=True)]
    parts = [part for part in asset.visual if len(part.faces)]
    links = [_link(name, link, to_object) for name, link in zip(names, found.links, strict=True)]
    dropped = []
    for place, link in enumerate(links):
        points = np.concatenate([part.vertices for part, of in zip(parts, shown, strict=True) if of == place])
        why = _too_large(link, transform_points(to_object, points))
        if why is not None:
            links[place] = link.model_copy(update={"inertia_kg_m2": None})
            dropped.append(why)
    try:
        moving = Articulation(links=links, joints=[Joint.of(joint, names) for joint in joints], link_of_mesh=shown)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        raise AssetError(f"{asset.path.name}: its joints: {first['msg']}; mend it where it was made") from error
    return moving, dropped


def _too_large(link: GivenLink, points_m: np.ndarray) -> str | None:
    """Return why an inertia is too large for its mass within the visual points ``(N, 3)`` m; None if it is possible."""
    if link.mass_kg is None or link.center_of_mass_m is None or link.inertia_kg_m2 is None:
        return None
    reach_m = float(np.linalg.norm(points_m - link.center_of_mass_m, axis=1).max())
    largest, most = float(np.linalg.eigvalsh(link.inertia_kg_m2)[-1]), link.mass_kg * reach_m**2
    if largest <= _UNSEEN * most:
        return None
    return (
        f"inertia of link {link.name[:60]!r}: {largest:.2g} kg m2 about an axis, but {link.mass_kg:.3g} kg within"
        f" {1000 * reach_m:.3g} mm of its centre have {most:.2g} at most"
    )


def _link(name: str, link: AssetLink, to_object: np.ndarray) -> GivenLink:
    said = link.inertial
    if said.mass_kg is None or said.center_of_mass_m is None or said.inertia_kg_m2 is None or not said.mass_kg > 0:
        return GivenLink(name=name, mass_kg=None, center_of_mass_m=None, inertia_kg_m2=None)
    inertia = np.asarray(said.inertia_kg_m2, float)
    moments = np.linalg.eigvalsh((inertia + inertia.T) / 2)
    if not (moments[0] > 0 and moments[2] <= (moments[0] + moments[1]) * (1 + _ROUNDING)):
        return GivenLink(name=name, mass_kg=None, center_of_mass_m=None, inertia_kg_m2=None)
    rotation = to_object[:3, :3]
    center, turned = rotation @ said.center_of_mass_m + to_object[:3, 3], rotation @ inertia @ rotation.T
    return GivenLink(
        name=name,
        mass_kg=said.mass_kg,
        center_of_mass_m=center.tolist(),
        inertia_kg_m2=((turned + turned.T) / 2).tolist(),
    )


def _distinct(names: list[str]) -> list[str]:
    """Make names unique and non-empty: MJCF bodies and joints may be unnamed."""
    found: list[str] = []
    for name in names:
        kept, number = name or "unnamed", 1
        while kept in found:
            number += 1
            kept = f"{name or 'unnamed'}_{number}"
        found.append(kept)
    return found
