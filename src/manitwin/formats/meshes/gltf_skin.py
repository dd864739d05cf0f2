"""Skinned meshes of glTF documents, in the pose of the file (glTF 2.0, section 3.7.3)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from manitwin.formats.meshes.gltf_document import Accessors
from manitwin.formats.meshes.source import MeshSource

_REMEDY = "apply the pose and export a still mesh"
_LEAST_WEIGHT = 1e-6


def joint_matrices(
    tree: Mapping[str, Any], skin: Any, placed: Mapping[int, np.ndarray], accessors: Accessors, source: MeshSource
) -> np.ndarray:
    """Return the transforms (J, 4, 4) of a skin's joints, from the bind pose of the mesh to the scene.

    ``placed`` are the transforms of the scene's nodes. Raises InputError ``unreadable``.
    """
    skins = tree["skins"] if isinstance(tree.get("skins"), list) else []
    if isinstance(skin, bool) or not isinstance(skin, int) or not 0 <= skin < len(skins):
        raise source.unreadable(f"a node names skin {str(skin)[:20]}, which is not there", "export it again")
    joints, inverse_bind = skins[skin].get("joints"), skins[skin].get("inverseBindMatrices")
    if not isinstance(joints, list) or not joints or not all(isinstance(j, int) and j in placed for j in joints):
        raise source.unreadable("a joint of its skeleton is not in the scene", _REMEDY)
    world = np.array([placed[joint] for joint in joints])
    if inverse_bind is None:
        return world
    rows = accessors.array(inverse_bind)
    if rows.shape[1] != 16 or len(rows) < len(joints):
        raise source.unreadable("its skeleton has fewer bind matrices than joints", "export it again")
    with np.errstate(all="ignore"):  # overflows are found when vertices are checked
        return world @ rows[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1).astype(np.float64)


def influences(
    attributes: Mapping[str, Any], accessors: Accessors, count: int, source: MeshSource
) -> tuple[np.ndarray, np.ndarray]:
    """Return the joints (V, K) that influence each of ``count`` vertices, and their weights (V, K), which sum to 1.

    Raises InputError ``unreadable``.
    """
    joints, weights = [], []
    for number in range(len(attributes)):
        names = f"JOINTS_{number}", f"WEIGHTS_{number}"
        if not all(name in attributes for name in names):
            break
        rows = [accessors.array(attributes[name]) for name in names]
        if any(each.shape != (count, 4) for each in rows) or rows[0].dtype.kind != "u":
            raise source.unreadable(f"{names[0]} or {names[1]} does not fit the mesh", "export it again")
        joints.append(rows[0].astype(np.int64))
        weights.append(np.nan_to_num(rows[1].astype(np.float64)))
    if not joints:
        raise source.unreadable("a mesh is bound to a skeleton, and its vertices to no joint", _REMEDY)
    shares = np.hstack(weights)
    total = shares.sum(axis=1, keepdims=True)
    if not (total > _LEAST_WEIGHT).all():
        raise source.unreadable("some of its vertices are bound to no joint of its skeleton", _REMEDY)
    return np.hstack(joints), shares / total


def apply_skin(
    vertices: np.ndarray,
    normals: np.ndarray | None,
    bound_to: tuple[np.ndarray, np.ndarray],
    matrices: np.ndarray,
    source: MeshSource,
) -> tuple[np.ndarray, np.ndarray | None]:
    """Return vertices (V, 3) and normals (V, 3) posed by linear blend skinning.

    ``bound_to`` are the joints and weights of ``influences``; the transforms of a vertex's joints are blended by its weights.
    Raises InputError ``unreadable`` for a joint that does not exist.
    """
    joints, shares = bound_to
    if len(joints) and int(joints.max()) >= len(matrices):
        raise source.unreadable("a vertex is bound to a joint that is not in its skeleton", "export it again")
    with np.errstate(all="ignore"):
        blend = np.zeros((len(vertices), 3, 4))
        for place in range(joints.shape[1]):
            blend += shares[:, place, None, None] * matrices[joints[:, place], :3]
        moved = np.einsum("vij,vj->vi", blend[:, :, :3], vertices) + blend[:, :, 3]
        if normals is None:
            return moved, None
        turned = np.einsum("vij,vj->vi", _cofactors(blend[:, :, :3]), normals)
        return moved, turned / np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-300)


def _cofactors(matrices: np.ndarray) -> np.ndarray:
    """Return the cofactor matrices (V, 3, 3), which transform normals like inverse transposes and exist for singular matrices."""
    rows = matrices[:, [1, 2, 0]], matrices[:, [2, 0, 1]]
    return np.cross(*rows)
