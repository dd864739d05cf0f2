"""The order of the pipeline's stages, for tables and pages that name stages and build none."""

from __future__ import annotations

STAGE_ORDER = (
    *(
        "photo",
        "name",
        "generate",
        "mesh",
        "views",
        "gate",
        "physical",
        "collision",
        "placement",
        "caption",
        "candidates",
    ),
    *("points", "parts", "grasps", "verify", "point_trials", "second_opinion", "robustness", "record_grasps", "finish"),
)
"""The order of ``recipe.stages_for``; twin.json keeps its stages by name."""


def place_in_pipeline(stage: str) -> tuple[int, str, int]:
    """Return what sorts stages as they run: all trials of one gripper (``verify-robotiq_2f85``) before the next one's.

    A stage that is none of the pipeline's comes behind them.
    """
    name, _, gripper = stage.partition("-")
    place = STAGE_ORDER.index(name) if name in STAGE_ORDER else len(STAGE_ORDER)
    first, last = STAGE_ORDER.index("grasps"), STAGE_ORDER.index("record_grasps")
    return (first if first <= place < last else place), gripper, place
