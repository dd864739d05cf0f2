"""Skinned meshes of USD stages, in the first pose of the stage (UsdSkel)."""

from __future__ import annotations

import numpy as np
from pxr import Tf, Usd, UsdGeom, UsdSkel, Vt

from manitwin.formats.meshes.source import MeshSource

_SMALLEST = 1e-12


def is_bound(prim: Usd.Prim) -> bool:
    """Return whether a mesh is bound to a skeleton."""
    return bool(prim.HasAPI(UsdSkel.BindingAPI) and UsdSkel.BindingAPI(prim).GetInheritedSkeleton())


class Skeletons:
    """The skeletons of a stage, each queried once."""

    def __init__(self, stage: Usd.Stage, source: MeshSource):
        self._source = source
        self._cache = UsdSkel.Cache()
        self._transforms = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
        for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)):
            if prim.IsA(UsdSkel.Root):
                self._cache.Populate(UsdSkel.Root(prim), Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate))

    def pose_points(self, prim: Usd.Prim, points: np.ndarray) -> np.ndarray:
        """Return a bound mesh's points ``(V, 3)`` posed by its skeleton, in the mesh's own frame.

        The pose is that of the first frame of its animation, or else the rest pose. Raises InputError ``unreadable``.
        """
        try:
            moved = self._skinned_points(prim, points)
        except (Tf.ErrorException, ValueError, TypeError) as error:
            raise self._broken(prim) from error
        if moved is None or moved.shape != points.shape:
            raise self._broken(prim)
        return moved

    def _skinned_points(self, prim: Usd.Prim, points: np.ndarray) -> np.ndarray | None:
        time = Usd.TimeCode.EarliestTime()
        skeleton = UsdSkel.BindingAPI(prim).GetInheritedSkeleton()
        pose, skin = self._cache.GetSkelQuery(skeleton), self._cache.GetSkinningQuery(prim)
        if not pose or not skin or not skin.HasJointInfluences():
            return None
        joints = pose.ComputeSkinningTransforms(time)
        if not joints:
            return None
        moved = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32))
        if not skin.ComputeSkinnedPoints(joints, moved, time):
            return None
        in_skeleton = np.asarray(moved, np.float64)
        to_world = np.array(self._transforms.GetLocalToWorldTransform(skeleton.GetPrim()))  # USD multiplies row vectors
        mesh_to_world = np.array(self._transforms.GetLocalToWorldTransform(prim))
        if abs(np.linalg.det(mesh_to_world)) < _SMALLEST:
            return None
        matrix = to_world @ np.linalg.inv(mesh_to_world)
        return in_skeleton @ matrix[:3, :3] + matrix[3, :3]

    def _broken(self, prim: Usd.Prim) -> Exception:
        cause = f"the skeleton that {prim.GetName()!r} is bound to does not fit it"
        return self._source.unreadable(cause, "apply the pose and export a still mesh")
