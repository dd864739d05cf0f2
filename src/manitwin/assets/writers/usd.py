"""USD: one stage in the binary form, with its textures beside it."""

from __future__ import annotations

from manitwin.assets.writers.content import TwinContent
from manitwin.assets.writers.exporter import Exported
from manitwin.assets.writers.usd_stage import CANNOT_SAY, build_stage, crate


def export(twin: TwinContent) -> Exported:
    """Return the stage and its textures as they are in the twin; ``usdcat`` shows the stage as text."""
    stage, textures = build_stage(twin)
    main = f"{twin.name}.usdc"
    return Exported({main: crate(stage.GetRootLayer()), **textures}, main, CANNOT_SAY)
