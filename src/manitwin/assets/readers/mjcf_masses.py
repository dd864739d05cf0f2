"""Declared mass properties of an MJCF file: from <inertial> elements, or from masses and densities of geoms."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from manitwin.assets.asset import Inertial, combined_inertial
from manitwin.assets.asset_files import AssetFiles
from manitwin.assets.readers.mjcf_document import MjcfSource
from manitwin.assets.readers.mjcf_model import LEAST_INERTIA_KG_M2, LEAST_MASS_KG
from manitwin.errors import AssetError
from manitwin.geometry.boxes import box_corners
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform

_INERTIA_FROM_GEOM = 1  # mjtInertiaFromGeom: true; 2 is auto
_DENSITY_KG_M3 = 1000.0  # MuJoCo's default for geoms without a density
_MOST_UNSAID_SHARE = 0.5
"""Largest share of a mass that may follow from MuJoCo's default density; above it, the mass counts as undeclared."""
_SAME_PLACE = 0.8
"""Least overlap of the boxes of two groups of shapes, by volume of their common box, for visual and collision shapes of one
part.
"""


class DeclaredMasses:
    """Determines what an MJCF file declares about the mass of its bodies."""

    def __init__(self, source: MjcfSource, spec: Any, model: Any, files: AssetFiles):
        self._source, self._spec, self._model, self._files = source, spec, model, files

    def inertial(self, bodies: list[tuple[int, np.ndarray]]) -> Inertial:
        """Return the mass properties of bodies with poses ``(4, 4)`` in the asset; empty if none are declared."""
        by_index = {body.id: body for body in self._spec.bodies}
        forced = int(self._spec.compiler.inertiafromgeom) == _INERTIA_FROM_GEOM
        massive = [(index, pose) for index, pose in bodies if self._model.body_mass[index] > 0]
        explicit = [index for index, _ in bodies if by_index[index].explicitinertial and not forced]
        if explicit and all(index in explicit for index, _ in massive):
            return combined_inertial([self._inertial(index, pose) for index, pose in bodies if index in explicit])
        if (
            not (explicit or self._source.has_mass_data()) or self._files.has_missing_mesh
        ):  # the mass of a missing mesh is unknown
            return Inertial()
        if not massive:
            return Inertial(0.0, computed=True)
        total_kg = sum(float(self._model.body_mass[index]) for index, _ in massive)
        if not explicit and (said := self._declared_once(massive)):
            mass_kg = sum(each.mass_kg or 0.0 for each in said)
            self._files.remark(
                f"its mass of {mass_kg:.4g} kg follows from a mass or density written for its geoms; MuJoCo has {total_kg:.4g},"
                " as it weighs the same place again, by its own density of 1000 kg/m3, for shapes of which the file says none"
            )
            return replace(combined_inertial(said), computed=True, engine_kg=total_kg)
        unsaid_kg = sum(float(self._undeclared_kg[index]) for index, _ in massive)
        if unsaid_kg > _MOST_UNSAID_SHARE * total_kg:
            self._files.remark(
                f"of {total_kg:.4g} kg the file declares {total_kg - unsaid_kg:.4g}, and MuJoCo's density of 1000 kg/m3 makes the"
                " rest: they were not taken"
            )
            return Inertial()
        if explicit or unsaid_kg > 0:
            self._files.remark(
                "a part of its mass is declared, and MuJoCo computes the rest of shapes, by its density of 1000 kg/m3"
            )
        else:
            self._files.remark(
                "its mass follows from a mass or density written for its geoms; centre and inertia are MuJoCo's own"
            )
        return replace(combined_inertial([self._inertial(index, pose) for index, pose in massive]), computed=True)

    @cached_property
    def _undeclared_kg(self) -> np.ndarray:
        """The mass of each body ``(nbody,)``, kg, that follows from no written mass or density.

        It is the mass that bodies lose when geoms with MuJoCo's default density are weightless. A file that writes this very
        density declares it.
        """
        if self._model_without_undeclared is None:
            return np.zeros(self._model.nbody)
        kept = self._model_without_undeclared.body_mass
        return np.asarray(self._model.body_mass - np.where(kept > 2 * LEAST_MASS_KG, kept, 0.0))

    @cached_property
    def _undeclared_geoms(self) -> frozenset[int]:
        """The geoms for which the file writes neither mass nor density."""
        if self._source.total_mass_kg is not None or self._source.has_geom_density(_DENSITY_KG_M3):
            return frozenset()
        return frozenset(g.id for g in self._spec.geoms if math.isnan(g.mass) and g.density == _DENSITY_KG_M3)

    @cached_property
    def _model_without_undeclared(self) -> Any:
        """The model in which geoms with MuJoCo's default density are weightless; None if there are no such geoms."""
        if not self._undeclared_geoms:
            return None
        trial = self._spec.copy()
        for geom in trial.geoms:
            if geom.id in self._undeclared_geoms:
                geom.mass = 0.0
        trial.compiler.boundmass, trial.compiler.boundinertia = LEAST_MASS_KG, LEAST_INERTIA_KG_M2
        try:
            return trial.compile()
        except (ValueError, RuntimeError, mujoco.FatalError) as error:
            raise AssetError(f"{self._source.file.name}: MuJoCo cannot compile it without its own density") from error

    def _declared_once(self, bodies: list[tuple[int, np.ndarray]]) -> list[Inertial]:
        """Return the declared mass properties of bodies whose undeclared shapes only duplicate declared ones.

        Such a file gives its collision shapes a density, and does not exclude its visual shapes from the mass. The list is
        empty if a body has undeclared shapes elsewhere, or no body has any.
        """
        weighed = [index for index, _ in bodies if self._undeclared_kg[index] > 1e-6 * self._model.body_mass[index]]
        if not weighed or not all(_in_one_place(self._model, index, self._undeclared_geoms) for index in weighed):
            return []
        return [self._inertial(index, pose, self._model_without_undeclared) for index, pose in bodies]

    def _inertial(self, index: int, body_to_asset: np.ndarray, model: Any = None) -> Inertial:
        model = self._model if model is None else model
        inertial_to_asset = body_to_asset @ transform(
            rotation_from_quaternion_wxyz(model.body_iquat[index]), model.body_ipos[index]
        )
        rotation = inertial_to_asset[:3, :3]
        tensor = rotation @ np.diag(model.body_inertia[index]) @ rotation.T
        return Inertial(float(model.body_mass[index]), inertial_to_asset[:3, 3], tensor)


def _in_one_place(model: Any, body: int, unsaid: frozenset[int]) -> bool:
    """Return whether the ``unsaid`` geoms of a body and its other geoms have nearly the same bounding box."""
    first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    own = range(first, first + count)
    groups = [[g for g in own if (g in unsaid) == each] for each in (True, False)]
    if not all(groups):
        return False
    corners = [np.concatenate([_corners(model, geom) for geom in group]) for group in groups]
    low, high = (np.array([side(each, axis=0) for each in corners]) for side in (np.min, np.max))
    shared = np.clip(high.min(0) - low.max(0), 0, None)
    return bool(np.prod(shared) > _SAME_PLACE * np.prod(high.max(0) - low.min(0)))


def _corners(model: Any, geom: int) -> np.ndarray:
    """Return points ``(N, 3)`` in body axes with the extent of a geom: the vertices of a mesh, or the corners of its box."""
    mesh = int(model.geom_dataid[geom])
    if mesh >= 0 and int(model.geom_type[geom]) == int(mujoco.mjtGeom.mjGEOM_MESH):
        start = int(model.mesh_vertadr[mesh])
        points = np.asarray(model.mesh_vert[start : start + int(model.mesh_vertnum[mesh])], float)
    else:
        center, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
        points = box_corners(np.asarray(half, float), transform(translation=np.asarray(center, float)))
    return np.asarray(points @ rotation_from_quaternion_wxyz(model.geom_quat[geom]).T + model.geom_pos[geom])
