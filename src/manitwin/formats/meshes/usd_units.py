"""The unit that a USD stage says its lengths and masses are in."""

from __future__ import annotations

from pxr import Usd, UsdGeom, UsdPhysics


def metres_per_unit(stage: Usd.Stage) -> float | None:
    """Return one of the stage's lengths in metres, None where it does not say (USD's rule is then 0.01)."""
    return _said(stage, str(UsdGeom.Tokens.metersPerUnit))


def kilograms_per_unit(stage: Usd.Stage) -> float | None:
    """Return one of the stage's masses in kilograms, None where it does not say (USD's rule is then 1)."""
    return _said(stage, str(UsdPhysics.Tokens.kilogramsPerUnit))


def _said(stage: Usd.Stage, key: str) -> float | None:
    """Return a number of the stage's metadata, which the session layer overrides and the root layer says.

    Read from the layers, whose numbers come in any type: ``UsdGeom.GetStageMetersPerUnit`` and their like raise for a binary
    file that holds single precision where the schema says double, as Blender's before 3.0 do.
    """
    for layer in (stage.GetSessionLayer(), stage.GetRootLayer()):
        root = layer.pseudoRoot if layer is not None else None
        if root is not None and root.HasInfo(key):
            number = root.GetInfo(key)
            return float(number) if isinstance(number, int | float) else None
    return None
