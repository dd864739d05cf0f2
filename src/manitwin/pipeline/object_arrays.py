"""The object as later stages read it: solid mesh, collision hulls, rigid body; object frame, SI units."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import trimesh

from manitwin.engine.stage import Draft
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.rigid_body import RigidBody
from manitwin.twin.grasp_table import JOINTS


def load_solid(path: Path) -> trimesh.Trimesh:
    """Load the watertight mesh of ``solid.npz``."""
    with np.load(path) as arrays:
        return trimesh.Trimesh(arrays["vertices"], arrays["faces"], process=False)


def load_hulls(path: Path) -> tuple[np.ndarray, ...]:
    """Load the convex vertices of ``hulls.npz``, each ``(V, 3)``, in the order of their names."""
    with np.load(path) as arrays:
        return tuple(arrays[name] for name in sorted(arrays.files))


def load_body(draft: Draft) -> RigidBody:
    """Load the hulls and the surface of ``solid.npz`` with the mass properties and friction of the field ``physical``."""
    physical = draft.field("physical")
    return RigidBody(
        hulls=load_hulls(draft.path("hulls.npz")),
        mass_kg=physical["mass_kg"]["value"],
        center_of_mass_m=np.array(physical["center_of_mass_m"]),
        inertia_kg_m2=np.array(physical["inertia_kg_m2"]),
        friction_static=physical["friction_static"]["value"],
        friction_dynamic=physical["friction_dynamic"]["value"],
        surface=RayCaster(load_solid(draft.path("solid.npz"))),
    )


def joints_of(proposals: Mapping[str, np.ndarray], index: np.ndarray) -> dict[str, np.ndarray]:
    """Return what a trial wants to know of the grasps at ``index`` beside their poses: the joints of hands with more."""
    if JOINTS[0] not in proposals:
        return {}
    return {"joints_rad": np.stack([proposals[name][index] for name in JOINTS], axis=1)}
