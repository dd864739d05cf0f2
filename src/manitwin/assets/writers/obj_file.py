"""Wavefront OBJ and MTL files, as MuJoCo, PyBullet, SAPIEN and Gazebo read them; the same mesh gives the same bytes."""

from __future__ import annotations

import numpy as np


def obj_file(
    vertices: np.ndarray,
    faces: np.ndarray,
    *,
    uv: np.ndarray | None = None,
    normals: np.ndarray | None = None,
    library: str | None = None,
    material: str | None = None,
) -> bytes:
    """Return an OBJ file with one object.

    ``vertices (V, 3)`` m, ``faces (F, 3)``, ``uv (V, 2)`` with the origin at the lower left, as OBJ has it, ``normals (V, 3)``.
    Vertices at one place are written once: a solid with texture seams stays closed for tools that look at indices. Numbers
    are the shortest that read back as the same ones, in the precision of the arrays.
    """
    lines = [f"mtllib {library}"] if library is not None else []
    corners: list[np.ndarray | None] = []
    for keyword, rows in (("v", vertices), ("vt", uv), ("vn", normals)):
        if rows is None:
            corners.append(None)
            continue
        distinct, index = np.unique(rows + 0.0, axis=0, return_inverse=True)  # + 0.0: no negative zeros
        lines += [f"{keyword} {' '.join(row)}" for row in distinct.astype(str).tolist()]
        corners.append((index.reshape(-1)[faces] + 1).astype(str))
    if material is not None:
        lines.append(f"usemtl {material}")
    lines += [f"f {' '.join(face)}" for face in _joined(*corners).tolist()]
    return ("\n".join(lines) + "\n").encode("ascii")


def mtl_file(
    name: str, *, rgba: tuple[float, float, float, float], roughness: float, metallic: float, texture: str | None
) -> bytes:
    """Return a material library of one material; ``rgba`` in sRGB, ``texture`` a file beside it.

    ``Pr`` and ``Pm`` are the roughness and metalness of the PBR extension that Blender and assimp read.
    """
    red, green, blue, alpha = rgba
    lines = [
        f"newmtl {name}",
        f"Kd {red!r} {green!r} {blue!r}",
        f"d {alpha!r}",
        "illum 2",
        f"Pr {roughness!r}",
        f"Pm {metallic!r}",
    ]
    if texture is not None:
        lines.append(f"map_Kd {texture}")
    return ("\n".join(lines) + "\n").encode("ascii")


def _joined(place: np.ndarray | None, uv: np.ndarray | None, normal: np.ndarray | None) -> np.ndarray:
    """Return the corners of faces ``(F, 3)`` as words: ``v``, ``v/vt``, ``v//vn`` or ``v/vt/vn``."""
    assert place is not None
    words = place
    if uv is not None or normal is not None:
        words = np.strings.add(words, "/")
    if uv is not None:
        words = np.strings.add(words, uv)
    if normal is not None:
        words = np.strings.add(np.strings.add(words, "/"), normal)
    return words
