"""Solve for a template's measures given several lengths at once: '30 x 20 x 15 cm', 'with a 20 cm blade'."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from manitwin.errors import UsageError
from manitwin.geometry.solids.parts import PartedMesh
from manitwin.geometry.solids.shapes import SolidError
from manitwin.models.generators.templates.template import Model, Template

X, Y, Z = range(3)
_AXES = {"height": (Z,), "width": (X, Y), "length": (X, Y, Z), "depth": (X, Y, Z), "": (X, Y, Z)}
"""Axes that a length with a direction may refer to; ``second`` refers to the axis of the second largest extent."""
_SPELT = {"": "longest side", "second": "second longest side"}
WALL = "wall_m"
MOST_STEPS, DIFFERENCE, CLOSE = 12, 0.01, 0.002
MOST_M = 100.0
LEAST_M3 = 1e-9
MARGIN = 2.0
"""Maximum factor by which a measure may leave its interval; beyond it, the template no longer describes the object."""


@dataclass(frozen=True)
class CapacityTarget:
    """A required capacity, its wording, and a function that computes the capacity from model, mesh and measures."""

    volume_m3: float
    said: str
    capacity_m3: Callable[[Model, PartedMesh, Mapping[str, float]], float]


def solve_proportions(
    template: Template,
    measures: Mapping[str, float],
    lengths_m: Mapping[str, float],
    part_lengths_m: Mapping[str, float],
    holds: CapacityTarget | None = None,
) -> dict[str, float]:
    """Return measures close to the given ones with which the object has the stated lengths; see ``_solve_lengths``.

    For objects taller than long, length, width and height may be the sides by size, as is usual for luggage: 55 x 40 x 20 cm.
    """
    try:
        return _solve_lengths(template, measures, lengths_m, part_lengths_m, holds)
    except UsageError:
        if lengths_m.keys() != {"length", "width", "height"} or template.any_proportions:
            raise
        sides = _sides_m(template, measures, {}, None)
        if sides[Z] < sides[:Z].max():
            raise
        by_size = dict(zip(("height", "width", "depth"), sorted(lengths_m.values(), reverse=True), strict=True))
        return _solve_lengths(template, measures, by_size, part_lengths_m, holds)


def _solve_lengths(
    template: Template,
    measures: Mapping[str, float],
    lengths_m: Mapping[str, float],
    part_lengths_m: Mapping[str, float],
    holds: CapacityTarget | None,
) -> dict[str, float]:
    """Return measures close to the given ones with which the object has the stated lengths.

    ``lengths_m`` are lengths by direction, ``part_lengths_m`` those of the longest side of a part or slot, ``holds`` an
    additional capacity. The object is scaled as a whole first. Then the logarithms of the measures, except the wall, are changed
    as little as possible (Gauss-Newton, minimum norm). Raises UsageError if the values cannot be met together, or for an unknown
    part.
    """
    changed = dict(measures)
    free = [name for name in template.measures if name != WALL]
    if template.length_of and "" in lengths_m:
        part_lengths_m = {template.length_of: lengths_m[""], **part_lengths_m}
        lengths_m = {direction: length for direction, length in lengths_m.items() if direction}
    said_m = [*lengths_m.items(), *part_lengths_m.items()]
    stated = [f"{_SPELT.get(name, name)} {length:g} m" for name, length in said_m] + ([holds.said] if holds else [])
    targets = np.array([length for _, length in said_m] + ([float(np.cbrt(holds.volume_m3))] if holds else []))
    if not ((targets > 0) & (targets < MOST_M)).all():
        raise UsageError(_impossible_message(template, stated))
    sides = _sides_m(template, changed, part_lengths_m, holds)
    said = [*_assign_axes(sides, lengths_m, targets), *range(3, len(sides))]
    if len(said) < len(targets):
        raise UsageError(f"{_impossible_message(template, stated)}; leave one of them out")
    larger = float(np.exp(np.log(targets / sides[said]).mean()))
    for name in free:
        changed[name] *= larger if template.measures[name].unit == "m" else 1.0
    for _ in range(MOST_STEPS):
        sides = _sides_m(template, changed, part_lengths_m, holds)[said]
        missing = np.log(targets / sides)
        if np.abs(missing).max() < CLOSE:
            if not template.any_proportions:
                _check(template, changed, free, stated)
            return changed
        slopes = np.empty((len(said), len(free)))
        for column, name in enumerate(free):
            longer = {**changed, name: changed[name] * (1 + DIFFERENCE)}
            moved = _sides_m(template, longer, part_lengths_m, holds)[said]
            slopes[:, column] = np.log(moved / sides) / np.log1p(DIFFERENCE)
        steps = np.clip(np.linalg.pinv(slopes, rcond=1e-3) @ missing, -0.5, 0.5)
        for name, step in zip(free, steps, strict=True):
            changed[name] *= float(np.exp(step))
    remedy = "leave one of them out" if len(stated) > 1 else "say the length of the whole"
    raise UsageError(f"{_impossible_message(template, stated)}; {remedy}")


def _assign_axes(sides_m: np.ndarray, lengths_m: Mapping[str, float], targets_m: np.ndarray) -> list[int]:
    """Return an axis for each length: the assignment, among those allowed, that changes the shape least; empty if there is none.

    ``targets_m (K,)`` are the lengths followed by the other targets, whose current values follow the three extents in
    ``sides_m``.
    """
    longest, middle, least = (int(axis) for axis in np.argsort(-sides_m[:3], kind="stable"))
    said = dict(zip(lengths_m, targets_m, strict=False))
    is_round = np.isclose(sides_m[longest], sides_m[middle], rtol=1e-3)
    if is_round and {"", "second"} <= said.keys() and not np.isclose(said[""], said["second"], rtol=1e-3):
        middle = least  # a bowl of 15 x 7 cm: width and height
    both = {"": (longest,), "second": (middle,)} if {"", "second"} <= lengths_m.keys() else {"second": (X, Y, Z)}
    choices = [both.get(direction, _AXES.get(direction, ())) for direction in lengths_m]
    of_parts = [*range(3, len(sides_m))]
    distinct = [axes for axes in product(*choices) if len({*axes}) == len(axes)]
    if not distinct:
        return []
    return list(min(distinct, key=lambda axes: float(np.std(np.log(targets_m / sides_m[[*axes, *of_parts]])))))


def _sides_m(
    template: Template, measures: Mapping[str, float], parts: Mapping[str, float], holds: CapacityTarget | None
) -> np.ndarray:
    """Return the extents along X, Y and Z, the longest side of each part, and the cube root of the capacity."""
    try:
        model = template.build(**measures)
        mesh = model.assembly.mesh()
    except SolidError as error:
        raise UsageError(f"no {template.category} has these lengths at once: {error}") from error
    sides = list(np.ptp(mesh.vertices, axis=0))
    for part in parts:
        first = next(iter(template.slots))
        worn = [name for name in mesh.names if part in (name, model.slots[name] or first)]
        if not worn:
            known = sorted({*template.slots, *mesh.names})
            raise UsageError(f"a {template.category} has no {part!r} here. Its parts: {', '.join(known)}")
        faces = mesh.faces[np.isin(mesh.part, [mesh.names.index(name) for name in worn])]
        sides.append(float(np.ptp(mesh.vertices[faces.ravel()], axis=0).max()))
    if holds is not None:
        sides.append(float(np.cbrt(max(holds.capacity_m3(model, mesh, measures), LEAST_M3))))
    return np.array(sides)


def _check(template: Template, measures: Mapping[str, float], names: list[str], stated: list[str]) -> None:
    for name in names:
        usual, value = template.measures[name], measures[name]
        if not usual.low / MARGIN <= value <= usual.high * MARGIN:
            unit = usual.unit or "(a ratio)"
            raise UsageError(
                f"{_impossible_message(template, stated)}: its {name.removesuffix('_m').replace('_', ' ')} would be"
                f" {value:.3g} {unit},"
                f" such are {usual.low:g} to {usual.high:g}; check the numbers and the unit"
            )


def _impossible_message(template: Template, stated: list[str]) -> str:
    return f"no {template.category} can be given {'all of this' if len(stated) > 1 else 'this'} ({', '.join(stated)})"
