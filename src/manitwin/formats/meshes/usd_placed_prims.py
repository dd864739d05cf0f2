"""Prims of a USD stage with their transforms, including instances of point instancers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from pxr import Tf, Usd, UsdGeom

from manitwin.formats.meshes.source import MeshSource

MAX_INSTANCES = 4096
"""Limit over all instancers: the number of shapes that one asset may have."""
MAX_PLACED = 100_000
_DEEPEST = 4
_TIME = Usd.TimeCode.EarliestTime()
_DRAWN = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
_OF_PROTOTYPES = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsLoaded)
"""Traversal of prototypes, which are often classes or overrides that are not drawn in place."""


@dataclass(frozen=True)
class PlacedPrim:
    """A prim and its transform ``(4, 4)`` to world, in the stage's unit.

    ``copy`` is 0 for a prim in place. Below the ``prototype`` of an ``instancer``, it is the number of the instance.
    """

    prim: Usd.Prim
    to_world: np.ndarray
    copy: int = 0
    prototype: Usd.Prim | None = None
    instancer: PlacedPrim | None = None

    def lineage(self) -> Iterator[Usd.Prim]:
        """Yield the prim and its ancestors, nearest first; a prototype is followed by its instancer and that one's ancestors."""
        prim = self.prim
        while prim and not prim.IsPseudoRoot():
            yield prim
            if prim == self.prototype:
                break
            prim = prim.GetParent()
        if self.instancer is not None:
            yield from self.instancer.lineage()

    def is_hidden(self) -> bool:
        """Return whether the prim or one of its ancestors is invisible."""
        if self.instancer is None:
            return bool(UsdGeom.Imageable(self.prim).ComputeVisibility() == UsdGeom.Tokens.invisible)
        return any(
            UsdGeom.Imageable(prim).GetVisibilityAttr().Get(_TIME) == UsdGeom.Tokens.invisible
            for prim in self.lineage()
            if prim.IsA(UsdGeom.Imageable)
        )


def placed_prims(stage: Usd.Stage, source: MeshSource) -> list[PlacedPrim]:
    """Return all drawn prims in stage order, with the instances of point instancers.

    Raises InputError ``unreadable`` for an instancer with inconsistent values, ``too_large`` for more than ``MAX_INSTANCES``
    instances. Source: the schema UsdGeomPointInstancer.
    """
    places = _Places(source)
    prims = iter(Usd.PrimRange(stage.GetPseudoRoot(), _DRAWN))
    for prim in prims:
        placed = PlacedPrim(prim, places.to_world(prim))
        places.found.append(placed)
        if prim.IsA(UsdGeom.PointInstancer):
            prims.PruneChildren()
            places.repeat(placed, 1)
    return places.found


class _Places:
    """Collector of placed prims."""

    def __init__(self, source: MeshSource):
        self._source = source
        self._transforms = UsdGeom.XformCache(_TIME)
        self._copies = 0
        self.found: list[PlacedPrim] = []

    def to_world(self, prim: Usd.Prim) -> np.ndarray:
        return np.array(self._transforms.GetLocalToWorldTransform(prim)).T  # USD multiplies row vectors

    def repeat(self, instancer: PlacedPrim, depth: int) -> None:
        """Place the instances of an instancer."""
        if depth > _DEEPEST:
            raise self._refused(instancer, f"repeats instancers more than {_DEEPEST} deep")
        targets = UsdGeom.PointInstancer(instancer.prim).GetPrototypesRel().GetForwardedTargets()
        prototypes = [instancer.prim.GetStage().GetPrimAtPath(target) for target in targets]
        for number, to_instancer in self._instances(instancer, len(prototypes)):
            prototype = prototypes[number]
            if not prototype:
                self._source.add_finding(f"a prototype of {instancer.prim.GetName()!r} is not there and was left out")
                continue
            self._copies += 1
            self._place(prototype, instancer, instancer.to_world @ to_instancer, depth)

    def _place(self, prototype: Usd.Prim, instancer: PlacedPrim, to_world: np.ndarray, depth: int) -> None:
        copy = self._copies
        prims = iter(Usd.PrimRange(prototype, _OF_PROTOTYPES))
        for prim in prims:
            within, _ = self._transforms.ComputeRelativeTransform(prim, prototype)
            placed = PlacedPrim(prim, to_world @ np.array(within).T, copy, prototype, instancer)
            self.found.append(placed)
            if len(self.found) > MAX_PLACED:
                raise self._refused(instancer, f"repeats more than {MAX_PLACED} prims", "merge them")
            if prim.IsA(UsdGeom.PointInstancer):
                prims.PruneChildren()
                self.repeat(placed, depth + 1)

    def _instances(self, instancer: PlacedPrim, prototypes: int) -> Iterator[tuple[int, np.ndarray]]:
        """Yield the prototype index of each visible instance, and its transform ``(4, 4)`` to the instancer."""
        api = UsdGeom.PointInstancer(instancer.prim)
        numbers = np.asarray(api.GetProtoIndicesAttr().Get(_TIME) or [], np.int64)
        if len(numbers) + self._copies > MAX_INSTANCES:
            raise self._source.too_large(
                f"point instancer {instancer.prim.GetName()!r} and others repeat more than {MAX_INSTANCES} instances",
                "it is not a single object",
            )
        if len(numbers) == 0:
            return
        if (numbers < 0).any() or (numbers >= prototypes).any():
            raise self._refused(instancer, f"has {prototypes} prototypes and names others by their number")
        try:
            transforms = api.ComputeInstanceTransformsAtTime(
                _TIME, _TIME, UsdGeom.PointInstancer.IncludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
            )
            mask = api.ComputeMaskAtTime(_TIME)
        except Tf.ErrorException:
            transforms, mask = [], []
        if len(transforms) != len(numbers):
            raise self._refused(instancer, f"has {len(numbers)} instances and not as many places for them")
        shown = np.asarray(mask, bool) if len(mask) == len(numbers) else np.ones(len(numbers), bool)
        for number in np.flatnonzero(shown).tolist():
            yield int(numbers[number]), np.array(transforms[number]).T

    def _refused(self, instancer: PlacedPrim, cause: str, remedy: str = "export it again") -> Exception:
        return self._source.unreadable(f"point instancer {instancer.prim.GetPath()} {cause}", remedy)
