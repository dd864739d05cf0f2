"""INE rules: plausibility of the inertia for shape and mass."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.fix import write_missing_inertial
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.assets.audit.rules.mass import positive_mass_kg
from manitwin.assets.audit.rules.scale import is_of_wrong_size

RELATIVE = 1e-4
"""Rounding: files often hold six digits."""

FACTOR = 3.0
"""Factor by which moments may exceed the range of a filled and of a thin-walled body of the shape.

A hammer head, ballast or motor concentrates mass within the shape. Our choice: none of 25 real objects and their exports is
reported.
"""

_NEWTON_STEPS, _CENTRED = 100, 1e-4  # of the size: convergence tolerance of the centre


def missing(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a mass without an inertia, and a missing centre of mass with it.

    MJCF states masses or densities of shapes, from which MuJoCo's compiler computes both (``inertiafromgeom``).
    """
    inertial = measured.asset.inertial
    if measured.asset.format == "mjcf":
        return
    if inertial.mass_kg and inertial.inertia_kg_m2 is None:  # without a mass (MAS002) there is no inertia
        centre = " and no centre of mass: they are" if inertial.center_of_mass_m is None else ": it is"
        yield Complaint(f"a mass is declared, but no inertia{centre} left to the simulator")


def principal_moments(inertia: np.ndarray) -> np.ndarray | None:
    """Return the principal moments of an inertia ``(3, 3)``, smallest first; None if it is not a finite symmetric matrix."""
    if inertia.shape != (3, 3) or not np.isfinite(inertia).all():
        return None
    if np.abs(inertia - inertia.T).max() > RELATIVE * max(np.abs(inertia).max(), 1e-300):
        return None
    return np.linalg.eigvalsh((inertia + inertia.T) / 2)


def not_positive_definite(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a tensor that is not symmetric, finite and positive definite."""
    inertia = measured.asset.inertial.inertia_kg_m2
    if inertia is None or (
        measured.asset.inertial.mass_kg == 0 and not inertia.any()
    ):  # no mass (MAS002), so no inertia
        return
    moments = principal_moments(inertia)
    if moments is None:
        yield Complaint(
            "the inertia is no symmetric matrix of finite numbers", values={"inertia_kg_m2": inertia.tolist()}
        )
    elif moments[0] <= 0:
        yield Complaint(
            f"the inertia is not positive definite: its least principal moment is {moments[0]:.3g} kg m2",
            values={"principal_kg_m2": moments.tolist()},
        )


def is_placeholder(inertia: np.ndarray | None) -> bool:
    """Return whether an inertia is the identity, as in templates."""
    return inertia is not None and inertia.shape == (3, 3) and bool(np.allclose(inertia, np.eye(3), atol=1e-9))


def placeholder(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report an inertia of 1.0 about all axes that is implausible for the shape."""
    inertia = measured.asset.inertial.inertia_kg_m2
    if not is_placeholder(inertia) or measured.asset.inertial.mass_kg == 0:
        return
    band = plausible_moments(measured)
    if band is None or (np.ones(3) > band[1]).any():
        typical = "" if band is None else f"; this shape and mass have some {np.sqrt(band[0] * band[1]).max():.2g}"
        yield Complaint(f"the inertia is the template's constant, 1.0 kg m2 about every axis{typical}")


def violates_triangle(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report moments that violate the triangle inequality."""
    moments = _sound_moments(measured)
    if moments is not None and moments[2] > (moments[0] + moments[1]) * (1 + RELATIVE):
        yield Complaint(
            f"principal moments {_listed(moments)} kg m2 belong to no body: the largest exceeds the sum of the others",
            values={"principal_kg_m2": moments.tolist()},
        )


def plausible_moments(measured: MeasuredAsset) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the least and largest principal moments ``(3,)`` kg m2 of the declared mass in this shape, without tolerance.

    The range covers a thin shell of the surface, the filled collision shapes, the filled convex hull, the filled surface if it
    is closed, and surface mass distributed as evenly as the declared centre of mass allows. None without a mass or a shape.
    """
    mass, surface = positive_mass_kg(measured), measured.surface
    if mass is None or surface is None:
        return None
    bodies = [surface.shell.inertia_per_kg_m2]
    if surface.solid_inertia_per_kg_m2 is not None:
        bodies.append(surface.solid_inertia_per_kg_m2)
    bodies += [shapes.uniform_solid.inertia_per_kg_m2 for shapes in (measured.hull, measured.shapes) if len(shapes)]
    leaning = skewed_inertia_per_kg_m2(measured.samples, measured.asset.inertial.center_of_mass_m)
    if leaning is not None:
        bodies.append(leaning)
    moments = mass * np.array([np.linalg.eigvalsh(body) for body in bodies])
    return moments.min(0), moments.max(0)


def skewed_inertia_per_kg_m2(points: np.ndarray, center_m: np.ndarray | None) -> np.ndarray | None:
    """Return the inertia ``(3, 3)`` m^2, about ``center_m (3,)``, of unit mass on points ``(N, 3)``, as even as possible.

    It accounts for uneven mass: a hammer with a steel head and a wooden handle has a smaller inertia than one of a single
    material. None without a centre, or if no distribution on the points has it. Source: the maximum entropy distribution with a
    given mean, by Newton's method.
    """
    if center_m is None or not len(points) or not np.isfinite(center_m).all():
        return None
    arms = points - center_m
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    lean = np.zeros(3)
    for _ in range(_NEWTON_STEPS):
        power = arms @ lean
        weights = np.exp(power - power.max())
        weights /= weights.sum()
        off = weights @ arms
        if np.linalg.norm(off) < _CENTRED * size:
            second = np.einsum("n,ni,nj->ij", weights, arms, arms)
            return np.asarray(np.trace(second) * np.eye(3) - second)
        spread = np.einsum("n,ni,nj->ij", weights, arms - off, arms - off)
        step = np.linalg.lstsq(spread, off, rcond=None)[0]
        lean -= step * min(1.0, 2.0 / max(float(np.abs(arms @ step).max()), 1e-12))
    return None


def magnitude(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report principal moments that are implausible for shape and mass."""
    moments, band = _sound_moments(measured), plausible_moments(measured)
    if moments is None or band is None or is_of_wrong_size(measured) or measured.asset.inertial.computed:
        return
    if measured.complaints(violates_triangle) or measured.complaints(placeholder):
        return
    low, high = band[0] / FACTOR, band[1] * FACTOR
    if (moments < low).any() or (moments > high).any():
        above, below = float((moments / band[1]).max()), float((moments / band[0]).min())
        off = f"up to {above:.2g} times the most" if above * below > 1 else f"down to {below:.2g} of the least"
        yield Complaint(
            f"principal moments {_listed(moments)} kg m2, but this shape and mass have about {_listed(band[0])} (filled or"
            f" thin-walled, whichever is less) to {_listed(band[1])}: {off}",
            values={"principal_kg_m2": moments.tolist(), "low_kg_m2": band[0].tolist(), "high_kg_m2": band[1].tolist()},
        )


def _sound_moments(measured: MeasuredAsset) -> np.ndarray | None:
    inertia = measured.asset.inertial.inertia_kg_m2
    moments = None if inertia is None else principal_moments(inertia)
    return None if moments is None or moments[0] <= 0 else moments


def _listed(values: np.ndarray) -> str:
    return ", ".join(f"{value:.2g}" for value in values)


RULES = (
    Rule(
        "INE001",
        "inertia-missing",
        "warning",
        why="Simulators fill the gap each in its own way: MuJoCo from the raw mesh, which over-counts (MuJoCo #2152), PhysX"
        " from the collision shapes at 1000 kg/m3 even where a mass is set. The same file behaves differently in each.",
        remedy="Write the full tensor about the centre of mass. `--fix` writes that of the collision hulls, evenly filled with"
        " the declared mass, into a URDF.",
        check=missing,
        fix=write_missing_inertial,
    ),
    Rule(
        "INE002",
        "inertia-not-positive-definite",
        "error",
        why="No body has such an inertia; engines refuse it, or explode at the first contact. A mesh with flipped faces gives"
        " one (frogger #8: a mass of -0.034 kg).",
        remedy="Compute it from a closed mesh with outward faces, about the centre of mass.",
        check=not_positive_definite,
    ),
    Rule(
        "INE003",
        "inertia-triangle-inequality",
        "error",
        why="For any body each principal moment is at most the sum of the two others. MuJoCo refuses to load what breaks it;"
        " others integrate it wrongly without a word.",
        remedy="Compute it from the shape; do not edit single entries of a tensor.",
        check=violates_triangle,
    ),
    Rule(
        "INE004",
        "inertia-placeholder",
        "error",
        why="EmbodiedGen, PhysX-Anything and scene_synthesizer write a constant 1.0 kg m2 into every URDF; a mug of 0.3 kg has"
        " 3e-4. Such an object cannot be turned: grasps that would let it tip hold it in simulation.",
        remedy="Compute it from shape and mass. `--fix` does, from the collision hulls of a URDF.",
        check=placeholder,
        fix=write_missing_inertial,
    ),
    Rule(
        "INE005",
        "inertia-magnitude",
        "error",
        why="Wrong units (g mm2), a forgotten mass or a forgotten scale leave a tensor that is possible, but not of this shape:"
        " newton #3236 and mujoco-usd-converter #99 (714 of 748 masses differ after conversion). The principal moments are"
        " held against those of a filled and of a thin-walled body of that shape and mass, with a factor of 3 on both sides.",
        remedy="Compute it again from the mesh in metres and the mass in kilograms, about the centre of mass.",
        check=magnitude,
    ),
)
