"""Wall thickness of a mesh: whether the mesh is a closed outer skin, and which materials and densities its wall indicates.

Containers and cups are made of plastic, clay or sheet metal, whose densities differ by a factor of eight, but so do the usual
thicknesses of their walls: plastic is not moulded thick.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from manitwin.geometry.ray_caster import local_thickness
from manitwin.geometry.sampling import sample_surface
from manitwin.models.annotators.prior_records import DEVIATIONS_ACROSS, Interval, Prior
from manitwin.models.annotators.priors import load_materials

METALS = ("steel", "aluminium")
"""Materials that a prior's word "metal" stands for."""
HOLLOW_WHERE_THICK = (*METALS, "plastic")
"""Materials whose thick open walls consist of two skins, since neither sheet metal nor moulded plastic is that thick."""
MEASURED_SPREAD = 0.25  # natural log: error of a scan's median thickness and volume
LEAST_SHARE = 0.05  # materials less probable than this are left out of an interval meant to hold 90 %
_SKIN_FACTOR = 3.0  # a mesh this many times thicker than the usual wall is a closed outer skin
_LEAST_SKIN_M = (
    0.008  # above the median thickness of any thin-walled object with both sides modelled (measured: 5 mm at most)
)
_THICKNESS_SAMPLES = 800


def median_thickness(solid: trimesh.Trimesh, seed: int) -> float:
    """Return the median thickness of a mesh, measured inward from surface samples, in the mesh's unit."""
    points, normals, _ = sample_surface(solid, _THICKNESS_SAMPLES, np.random.default_rng(seed))
    return float(np.median(local_thickness(solid, points, normals)))


def is_outer_skin(thickness_m: float, wall_thickness_m: float) -> bool:
    """Tell whether a mesh of this median thickness lacks the inner side of the wall, because it is too thick to be the wall."""
    return thickness_m > max(_SKIN_FACTOR * wall_thickness_m, _LEAST_SKIN_M)


def density_by_wall(prior: Prior, solid: trimesh.Trimesh, seed: int) -> Interval | None:
    """Return the bulk density (kg/m3) from the wall thickness of a mesh in metres and the materials that its prior names.

    None if the prior names fewer than two wall materials, if such objects are not open containers, or if the mesh is thicker
    than the thickest of these walls.
    """
    options = wall_materials(prior)
    if (
        len(options) < 2
        or not prior.container
        or prior.mass_distribution != "solid"
        or prior.bulk_density_kg_m3 is None
    ):
        return None
    thickness_m = median_thickness(solid, seed)
    if thickness_m > max(each.wall_m.high for each in options.values()):
        return None
    return _mixture_density(list(options.values()), thickness_m, prior.bulk_density_kg_m3)


def density_as_stated(prior: Prior, density_kg_m3: float, solid: trimesh.Trimesh, seed: int) -> Interval | None:
    """Return the bulk density (kg/m3) from the wall thickness of a mesh in metres and its stated material.

    A wall of usual thickness is all material; a thicker one may be thickened by its scan. A wall thicker than any of sheet
    metal or moulded plastic consists of two skins. None if the object is not an open container, and for too thick walls of
    other materials.
    """
    walls, matter = load_materials()[prior.surface].wall_m, load_materials()[prior.surface].density_kg_m3
    if walls is None or not prior.container or prior.mass_distribution != "solid":
        return None
    thickness_m = median_thickness(solid, seed)
    usual = min(walls.typical / thickness_m, 1.0)
    shares = [usual / float(np.exp(DEVIATIONS_ACROSS / 2 * MEASURED_SPREAD)), usual**0.5, 1.0]
    if thickness_m > walls.high:
        if prior.surface not in HOLLOW_WHERE_THICK:
            return None
        skins = (2 * wall_m / thickness_m for wall_m in (walls.low, walls.typical, walls.high))
        shares = [min(share, 1.0) for share in skins]
    by = density_kg_m3 / matter.typical
    low, typical, high = (
        share * by * of for share, of in zip(shares, (matter.low, matter.typical, matter.high), strict=True)
    )
    return Interval(low=low, typical=typical, high=high)


@dataclass(frozen=True)
class WallMaterial:
    """A material of walls: density (kg/m3), usual wall thickness (m), and relative frequency among such objects."""

    density_kg_m3: Interval
    wall_m: Interval
    weight: float


def wall_materials(prior: Prior) -> dict[str, WallMaterial]:
    """Return the wall materials that a prior names, with equal weights; metals share the weight of one."""
    words = prior.material.replace(",", " ").split()
    names = [(name, 1 / len(METALS)) for name in METALS if "metal" in words] + [(word, 1.0) for word in words]
    known = load_materials()
    return {
        name: WallMaterial(known[name].density_kg_m3, walls, weight)
        for name, weight in names
        if name in known and (walls := known[name].wall_m) is not None
    }


def _mixture_density(options: Sequence[WallMaterial], thickness_m: float, within: Interval) -> Interval:
    """Return the mean density by the likelihood of this wall thickness, with an interval over all probable materials.

    All distributions are log-normal. ``within`` is the usual interval of scans; thickened sheet metal has less than the
    density of the metal.
    """
    spread = np.hypot([each.wall_m.log_spread for each in options], MEASURED_SPREAD)
    away = np.log(thickness_m / np.array([each.wall_m.typical for each in options])) / spread
    likelihood = np.array([each.weight for each in options]) * np.exp(-(away**2) / 2) / spread
    shares = likelihood / likelihood.sum()
    likely = [each.density_kg_m3 for each, share in zip(options, shares, strict=True) if share >= LEAST_SHARE]
    typical = np.clip([each.density_kg_m3.typical for each in options], within.low, within.high)
    beyond = float(np.exp(DEVIATIONS_ACROSS / 2 * MEASURED_SPREAD))
    ends = [min(each.low for each in likely) / beyond, max(each.high for each in likely) * beyond]
    low, high = np.clip(ends, within.low, within.high)
    mean = float(
        np.clip(np.exp(shares @ np.log(typical)), low, high)
    )  # rounding may move the mean of equal ends beyond them
    return Interval(low=float(low), typical=mean, high=float(high))
