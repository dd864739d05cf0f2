"""Length and mass units of a USD stage."""

from __future__ import annotations

from pxr import Usd, UsdGeom, UsdPhysics


def metres_per_unit(stage: Usd.Stage) -> float | None:
    """Return the stage's length unit in metres, None if not stated (USD's default is 0.01)."""
    return _stage_number(stage, str(UsdGeom.Tokens.metersPerUnit))


def kilograms_per_unit(stage: Usd.Stage) -> float | None:
    """Return the stage's mass unit in kilograms, None if not stated (USD's default is 1)."""
    return _stage_number(stage, str(UsdPhysics.Tokens.kilogramsPerUnit))


def _stage_number(stage: Usd.Stage, key: str) -> float | None:
    """Return a number of the stage's metadata, from the session layer or else the root layer.

    It is read from the layers, which may store any numeric type: ``UsdGeom.GetStageMetersPerUnit`` and similar functions raise
    for a binary file with single precision in place of double, as written by Blender before 3.0.
    """
    for layer in (stage.GetSessionLayer(), stage.GetRootLayer()):
        root = layer.pseudoRoot if layer is not None else None
        if root is not None and root.HasInfo(key):
            number = root.GetInfo(key)
            return float(number) if isinstance(number, int | float) else None
    return None
