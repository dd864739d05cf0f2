"""Drop test of an asset on a plane in physics engines, for defects that only simulation shows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.geometry.poses import rotation_between, transform, transform_points
from manitwin.geometry.rigid_body import RigidBody

FRICTION = 0.5
"""Friction if an asset declares none; it affects how far an object slides, not whether it comes to rest."""

DROP_M = 0.005
SECONDS = 4.0

STEP_S = {"mujoco": 1 / 500, "sapien": 1 / 240, "pybullet": 1 / 240}
"""The engines, with the time step that each one's documentation and examples use."""


@dataclass(frozen=True)
class DropRun:
    """One drop: the final pose ``end (4, 4)``, asset to plane, and whether the asset is at rest.

    ``refused`` has the error message of the engine if it does not run.
    """

    engine: str
    timestep_s: float
    end: np.ndarray | None = None
    at_rest: bool = False
    refused: str = ""


@dataclass(frozen=True)
class DropRuns:
    """The runs of an asset, from ``start (4, 4)``; ``why_not`` is the reason if there are none."""

    body: RigidBody | None
    start: np.ndarray | None
    runs: tuple[DropRun, ...] = ()
    why_not: str = ""

    def height_m(self, run: DropRun) -> float:
        """Return the final height of the centre of mass above the plane."""
        assert self.body is not None and run.end is not None
        return float(transform_points(run.end, self.body.center_of_mass_m[None])[0, 2])

    def lowest_m(self, run: DropRun) -> float:
        """Return the final height of the lowest point of the collision shapes above the plane."""
        assert self.body is not None and run.end is not None
        end = run.end
        return min(float((hull @ end[2, :3]).min()) for hull in self.body.hulls) + float(end[2, 3])


def run_drops(measured: MeasuredAsset) -> DropRuns:
    """Drop the asset in each requested engine, with its usual time step and with half of it."""
    body, why_not = _body(measured)
    if body is None:
        return DropRuns(None, None, why_not=why_not)
    turn = rotation_between(measured.up, np.array([0.0, 0, 1]))
    lowest_m = min(float((hull @ turn.T)[:, 2].min()) for hull in body.hulls)
    start = transform(turn, np.array([0, 0, -lowest_m]))
    runs = [run for engine in measured.engines for run in _runs(engine, body, start)]
    return DropRuns(body, start, tuple(runs))


def _runs(engine: str, body: RigidBody, start: np.ndarray) -> Iterator[DropRun]:
    for timestep_s in (STEP_S[engine], STEP_S[engine] / 2):
        try:
            yield _ENGINES[engine](body, start, timestep_s)
        except (RuntimeError, ValueError, FloatingPointError, np.linalg.LinAlgError) as error:
            yield DropRun(engine, timestep_s, refused=" ".join(str(error).split())[:200] or type(error).__name__)
            return


def _body(measured: MeasuredAsset) -> tuple[RigidBody | None, str]:
    asset, inertial = measured.asset, measured.asset.inertial
    if asset.static:
        return None, "it is said to stand fast"
    said = {
        "mass": inertial.mass_kg, "centre of mass": inertial.center_of_mass_m, "inertia": inertial.inertia_kg_m2
    }  # fmt: skip
    absent = [name for name, value in said.items() if value is None]
    if absent:
        return None, f"it declares no {' and no '.join(absent)}"
    assert inertial.mass_kg is not None and inertial.inertia_kg_m2 is not None
    inertia = np.asarray(inertial.inertia_kg_m2, float)
    if not (np.isfinite(inertia).all() and inertial.mass_kg > 0 and (np.linalg.eigvalsh(inertia) > 0).all()):
        return None, "its mass or inertia is not positive"
    hulls = tuple(_hulls(measured))
    if not hulls:
        return None, "it has no collision shape with a volume"
    declared = [asset.contact.friction_static, asset.contact.friction_dynamic]
    static, dynamic = (FRICTION if value is None or not 0 <= value <= 10 else value for value in declared)
    center = np.asarray(inertial.center_of_mass_m, float)
    return RigidBody(hulls, inertial.mass_kg, center, inertia, static, min(dynamic, static)), ""


def _hulls(measured: MeasuredAsset) -> Iterator[np.ndarray]:
    for index in measured.shapes.kept:
        vertices = np.asarray(measured.asset.collision[index].vertices, float)
        try:
            yield vertices[ConvexHull(vertices).vertices]
        except QhullError:
            continue


def _mujoco(body: RigidBody, start: np.ndarray, timestep_s: float) -> DropRun:
    from manitwin.physics.mujoco.settle import settle_on_plane_in_mujoco

    (end,) = settle_on_plane_in_mujoco(body, [start], drop_m=DROP_M, seconds=SECONDS, timestep_s=timestep_s)
    return DropRun("mujoco", timestep_s, _finite(end.object_to_plane), end.at_rest)


def _sapien(body: RigidBody, start: np.ndarray, timestep_s: float) -> DropRun:
    from manitwin.physics.sapien.settle import settle_on_plane

    (end,) = settle_on_plane(body, [start], drop_m=DROP_M, seconds=SECONDS, timestep_s=timestep_s)
    return DropRun("sapien", timestep_s, _finite(end.object_to_plane), end.at_rest)


def _pybullet(body: RigidBody, start: np.ndarray, timestep_s: float) -> DropRun:
    from manitwin.assets.audit.pybullet_run import drop_in_pybullet

    end, at_rest = drop_in_pybullet(body, start, DROP_M, SECONDS, timestep_s)
    return DropRun("pybullet", timestep_s, _finite(end), at_rest)


def _finite(pose: np.ndarray) -> np.ndarray:
    if not np.isfinite(pose).all():
        raise FloatingPointError("its pose is no number any more: the simulation blows up")
    return pose


_ENGINES: dict[str, Callable[[RigidBody, np.ndarray, float], DropRun]] = {
    "mujoco": _mujoco, "sapien": _sapien, "pybullet": _pybullet
}  # fmt: skip
