"""Reader of CAD solids in STEP (ISO 10303-21), whose exact surfaces OpenCASCADE triangulates."""

from __future__ import annotations

from importlib.util import find_spec

import trimesh

from manitwin.formats.isolated import Limits, ProcessCrashed, run_isolated
from manitwin.formats.meshes.gltf import read_gltf
from manitwin.formats.meshes.source import MeshSource

INSTALL = "pip install 'manitwin[cad]'"
DEFLECTION_MM, ANGLE_RAD = 0.05, 0.2
"""Largest distance of a triangle from its surface, and angle between neighbours along it: 32 sides for a round hole."""
_LIMITS = Limits(seconds=600.0)


def read_step(source: MeshSource) -> list[trimesh.Trimesh]:
    """Read the solids of a STEP file into parts in its own axes, in metres whatever its unit, with its colours.

    Raises InputError ``wrong_type`` if the packages of ``manitwin[cad]`` are not installed, ``unreadable``, ``too_large``.
    """
    if find_spec("cascadio") is None:
        raise source.refused("wrong_type", "the STEP reader is not installed", f"{INSTALL}, or export it as glTF 2.0")
    try:
        glb = run_isolated(f"{__name__}:triangulated", source.data(), limits=_LIMITS)
    except ProcessCrashed as error:
        cause = f"OpenCASCADE crashes on it, or takes more than {_LIMITS.seconds:g} s"
        raise source.unreadable(cause, "export it as glTF 2.0") from error
    if not glb:
        raise source.unreadable("its STEP is broken, or contains no solid or surface", "export it again")
    return read_gltf(source, binary=True, data=glb)


def triangulated(data: bytes) -> bytes:
    """Return the GLB of a STEP file's content, in metres and in its own axes; empty if nothing is readable.

    To be run in an isolated process: OpenCASCADE prints to standard output, and crashes on some broken files.
    """
    import cascadio

    try:
        glb: bytes = cascadio.load(data, tol_linear=DEFLECTION_MM, tol_angular=ANGLE_RAD, use_parallel=False)
    except (RuntimeError, ValueError):
        return b""
    return glb
