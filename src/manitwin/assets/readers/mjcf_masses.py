"""The mass properties that an MJCF file declares: of its <inertial> elements, or of masses and densities of geoms."""

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
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform

_INERTIA_FROM_GEOM = 1  # mjtInertiaFromGeom: true; 2 is auto
_DENSITY_KG_M3 = 1000.0  # MuJoCo's own, of geoms that say none
_MOST_UNSAID_SHARE = 0.5
"""Where more of a mass follows from MuJoCo's own density, the file does not declare it: 549 kg with a door of 2."""


class DeclaredMasses:
    """Tells what an MJCF file declares of the mass of its bodies."""

    def __init__(self, source: MjcfSource, spec: Any, model: Any, files: AssetFiles):
        self._source, self._spec, self._model, self._files = source, spec, model, files

    def of(self, bodies: list[tuple[int, np.ndarray]]) -> Inertial:
        """Return the mass properties of bodies with their poses ``(4, 4)`` in the asset; empty where none are declared."""
        by_index = {body.id: body for body in self._spec.bodies}
        forced = int(self._spec.compiler.inertiafromgeom) == _INERTIA_FROM_GEOM
        massive = [(index, pose) for index, pose in bodies if self._model.body_mass[index] > 0]
        explicit = [index for index, _ in bodies if by_index[index].explicitinertial and not forced]
        if explicit and all(index in explicit for index, _ in massive):
            return combined_inertial([self._inertial(index, pose) for index, pose in bodies if index in explicit])
        if not (explicit or self._source.weighs()) or self._files.lacks_a_mesh:  # of which nothing is known
            return Inertial()
        if not massive:
            return Inertial(0.0, computed=True)
        total_kg = sum(float(self._model.body_mass[index]) for index, _ in massive)
        unsaid_kg = sum(float(self._unsaid_kg[index]) for index, _ in massive)
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
    def _unsaid_kg(self) -> np.ndarray:
        """What of the mass of each body ``(nbody,)`` follows from no mass or density that the file writes.

        It is what the bodies lose where geoms of MuJoCo's own density weigh nothing. A file that writes this very density
        declares it.
        """
        nothing = np.zeros(self._model.nbody)
        if self._source.total_mass_kg is not None or self._source.writes_density(_DENSITY_KG_M3):
            return nothing
        trial = self._spec.copy()
        unsaid = [geom for geom in trial.geoms if math.isnan(geom.mass) and geom.density == _DENSITY_KG_M3]
        if not unsaid:
            return nothing
        for geom in unsaid:
            geom.mass = 0.0
        trial.compiler.boundmass, trial.compiler.boundinertia = LEAST_MASS_KG, LEAST_INERTIA_KG_M2
        try:
            kept = trial.compile().body_mass
        except (ValueError, RuntimeError, mujoco.FatalError) as error:
            raise AssetError(f"{self._source.file.name}: MuJoCo cannot compile it without its own density") from error
        return np.asarray(self._model.body_mass - np.where(kept > 2 * LEAST_MASS_KG, kept, 0.0))

    def _inertial(self, index: int, body_to_asset: np.ndarray) -> Inertial:
        inertial_to_asset = body_to_asset @ transform(
            rotation_from_quaternion_wxyz(self._model.body_iquat[index]), self._model.body_ipos[index]
        )
        rotation = inertial_to_asset[:3, :3]
        tensor = rotation @ np.diag(self._model.body_inertia[index]) @ rotation.T
        return Inertial(float(self._model.body_mass[index]), inertial_to_asset[:3, 3], tensor)
