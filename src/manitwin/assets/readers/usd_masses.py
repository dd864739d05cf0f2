"""Declared masses, frictions and restitution of the prims of a USD stage (UsdPhysics)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

from manitwin.assets.asset import Contact, Inertial, combined_inertial
from manitwin.assets.filled_hulls import filled_hulls
from manitwin.assets.readers.usd_shapes import Felt, metric_transform
from manitwin.errors import AssetError
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.usd_placed_prims import PlacedPrim
from manitwin.formats.meshes.usd_units import kilograms_per_unit, metres_per_unit
from manitwin.geometry.poses import rotation_from_quaternion_wxyz

_LARGEST_UNIT = 1e6


@dataclass(frozen=True)
class StageUnits:
    """The units of a stage in metres and kilograms; ``declared``: the stage states its length unit."""

    m: float
    kg: float
    declared: bool

    @classmethod
    def of(cls, stage: Usd.Stage, source: MeshSource) -> StageUnits:
        """Read the units of a stage; raises AssetError for a unit that is not a positive number."""
        said_m, said_kg = metres_per_unit(stage), kilograms_per_unit(stage)
        declared = said_m is not None
        unit_m = float(UsdGeom.LinearUnits.centimeters) if said_m is None else said_m
        unit_kg = float(UsdPhysics.MassUnits.kilograms) if said_kg is None else said_kg
        if not (np.isfinite(unit_m) and 0 < unit_m < _LARGEST_UNIT):
            raise AssetError(
                f"{source.path}: its metersPerUnit is {unit_m}; give a number above 0 and below {_LARGEST_UNIT:g}, such as 1"
            )
        if not (np.isfinite(unit_kg) and unit_kg > 0):
            raise AssetError(f"{source.path}: its kilogramsPerUnit is {unit_kg}; give a number above 0, such as 1")
        if not declared:
            source.add_finding(f"it declares no metersPerUnit: USD's rule of {unit_m:g} m was taken")
        return cls(unit_m, unit_kg, declared)


def is_rigid_body(prim: Usd.Prim) -> bool:
    """Return whether a prim is an enabled rigid body."""
    return bool(prim.HasAPI(UsdPhysics.RigidBodyAPI)) and (
        UsdPhysics.RigidBodyAPI(prim).GetRigidBodyEnabledAttr().Get() is not False
    )


def body_of(placed: PlacedPrim) -> Usd.Prim | None:
    """Return the rigid body to which a prim belongs: the prim itself, or its nearest ancestor that is one."""
    return next((prim for prim in placed.lineage() if is_rigid_body(prim)), None)


def declared_inertial(
    placed: Sequence[PlacedPrim], felt: Sequence[Felt], units: StageUnits, source: MeshSource
) -> Inertial:
    """Return mass, centre of mass and inertia declared by MassAPI, in kg and m in the stage's axes.

    The mass of a prim includes all prims below it in the same rigid body; several separate ones are combined. Values that the
    schema leaves unspecified (inertia, centre) are None; an authored mass of 0 is kept. Source: UsdPhysics schema, MassAPI.
    """
    bodies: list[Inertial] = []
    taken: set[tuple[Sdf.Path, Usd.Prim | None]] = set()
    for each in placed:
        prim = each.prim
        if not prim.HasAPI(UsdPhysics.MassAPI):
            continue
        rigid = body_of(each)
        if any(above != prim and (above.GetPath(), rigid) in taken for above in each.lineage()):
            continue
        body = _inertial_of_prim(each, units, source)
        if body.mass_kg is not None:
            taken.add((prim.GetPath(), rigid))
            bodies.append(body)
        elif body.inertia_kg_m2 is not None or body.center_of_mass_m is not None:
            source.add_finding(f"{prim.GetName()} has a centre of mass or an inertia and no mass")
    if bodies:
        return combined_inertial(bodies)
    if any(each.prim.HasAPI(UsdPhysics.MassAPI) for each in placed):
        source.add_finding("it has a mass API and no mass")
    return _inertial_from_densities(felt, units, source)


def complete_from_hulls(inertial: Inertial, felt: Sequence[Felt]) -> Inertial:
    """Complete an inertial with centre and inertia of its mass, distributed uniformly in the hulls of its collision shapes.

    Source: UsdPhysics schema, MassAPI: undeclared values follow from the collision shapes.
    """
    if inertial.mass_kg is None or not inertial.mass_kg > 0:
        return inertial
    if inertial.center_of_mass_m is not None and inertial.inertia_kg_m2 is not None:
        return inertial
    even = filled_hulls([(shape.vertices, 1.0) for shape, _ in felt])
    if not even.mass_kg or even.center_of_mass_m is None or even.inertia_kg_m2 is None:
        return inertial
    said, center = inertial.inertia_kg_m2, inertial.center_of_mass_m
    return Inertial(
        inertial.mass_kg,
        even.center_of_mass_m if center is None else center,
        even.inertia_kg_m2 * (inertial.mass_kg / even.mass_kg) if said is None else said,
        computed=True,
    )


def _inertial_from_densities(felt: Sequence[Felt], units: StageUnits, source: MeshSource) -> Inertial:
    """Return the inertial of collision hulls filled with their densities; empty if a shape has no density.

    The density is that of the nearest MassAPI at or above a shape, or else of its bound material (UsdPhysics, density).
    """
    filled: list[tuple[np.ndarray, float]] = []
    for shape, placed in felt:
        density = _density(placed, source)
        if not density or density < 0:
            return Inertial()
        filled.append((shape.vertices, density * units.kg / units.m**3))
    found = filled_hulls(filled)
    if found.mass_kg is not None:
        source.add_finding(
            "its mass follows from a density; it, the centre and the inertia are of the hulls of its collision shapes"
        )
    return found


def _density(placed: PlacedPrim, source: MeshSource) -> float | None:
    for above in placed.lineage():
        if above.HasAPI(UsdPhysics.MassAPI):
            density = authored_number(UsdPhysics.MassAPI(above).GetDensityAttr(), source)
            if density:
                return density
    material, _ = UsdShade.MaterialBindingAPI(placed.prim).ComputeBoundMaterial("physics")
    bound = material.GetPrim() if material else None
    if bound is None or not bound.HasAPI(UsdPhysics.MaterialAPI):
        return None
    return authored_number(UsdPhysics.MaterialAPI(bound).GetDensityAttr(), source)


def declared_contact(placed: Sequence[PlacedPrim], felt: Sequence[Felt], source: MeshSource) -> Contact:
    """Return friction and restitution of the material bound to the collision shapes; the first one if they differ."""
    found: dict[str, Contact] = {}
    for _, shape in felt:
        material, _ = UsdShade.MaterialBindingAPI(shape.prim).ComputeBoundMaterial("physics")
        bound = material.GetPrim() if material else None
        if bound is None or not bound.HasAPI(UsdPhysics.MaterialAPI) or str(bound.GetPath()) in found:
            continue
        api = UsdPhysics.MaterialAPI(bound)
        found[str(bound.GetPath())] = Contact(
            authored_number(api.GetStaticFrictionAttr(), source),
            authored_number(api.GetDynamicFrictionAttr(), source),
            authored_number(api.GetRestitutionAttr(), source),
        )
    contacts = list(found.values())
    if any(contact != contacts[0] for contact in contacts):
        source.add_finding(f"{len(contacts)} physics materials are bound to its collision shapes; the first was taken")
    if not contacts and any(each.prim.HasAPI(UsdPhysics.MaterialAPI) for each in placed):
        source.add_finding("it has a physics material that is bound to no collision shape")
    return contacts[0] if contacts else Contact()


def _inertial_of_prim(placed: PlacedPrim, units: StageUnits, source: MeshSource) -> Inertial:
    prim, unit_m, unit_kg, to_world = placed.prim, units.m, units.kg, metric_transform(placed, units.m, source)
    api = UsdPhysics.MassAPI(prim)
    mass = authored_number(api.GetMassAttr(), source)
    density = authored_number(api.GetDensityAttr(), source)
    if density and not mass:
        source.add_finding(
            f"{prim.GetName()} declares a density of {density * unit_kg / unit_m**3:g} kg/m3 in place of a mass"
        )
    center = api.GetCenterOfMassAttr().Get()
    moments = np.array(api.GetDiagonalInertiaAttr().Get(), dtype=float)
    turn = api.GetPrincipalAxesAttr().Get()
    wxyz = np.array([turn.GetReal(), *turn.GetImaginary()], dtype=float)
    declared = center is not None and not np.isneginf(np.array(center)).any()  # the fallback, -inf, means unspecified
    if not np.isfinite(moments).all() or not np.isfinite(wxyz).all() or (declared and not np.isfinite(center).all()):
        raise AssetError(f"{source.path}: the mass properties of {prim.GetPath()} are not finite; give finite numbers")
    left, stretch, right = np.linalg.svd(to_world[:3, :3] / unit_m)
    if np.abs(stretch - 1).max() > 1e-5:
        source.add_finding(
            f"{prim.GetName()} is scaled by {stretch.round(6).tolist()}, which its mass and inertia do not follow"
        )
    axes = rotation_from_quaternion_wxyz(wxyz) if np.linalg.norm(wxyz) > 0 else np.eye(3)
    turned = left @ right @ axes
    inertia = turned @ np.diag(moments * unit_kg * unit_m**2) @ turned.T if moments.any() else None
    center_m = to_world[:3, :3] @ np.array(center) + to_world[:3, 3] if declared else None
    return Inertial(None if mass is None else mass * unit_kg, center_m, inertia)


def authored_number(attribute: Usd.Attribute, source: MeshSource) -> float | None:
    """Return an authored number, or None for a schema fallback; raises AssetError for a number that is not finite."""
    if not attribute or not attribute.HasAuthoredValue():
        return None
    value: Any = attribute.Get(Usd.TimeCode.EarliestTime())
    if value is None or not np.isfinite(value):
        raise AssetError(f"{source.path}: {attribute.GetPath()} is {value}; give a finite number")
    return float(str(np.float32(value)))  # the shortest decimal of the stored float32: 0.45, not 0.44999998807907104
