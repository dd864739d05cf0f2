"""The order of the pipeline's stages, for tables and pages that name stages without creating them."""

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
"""The order of ``recipe.stages_for``; twin.json sorts its stages by name."""


def place_in_pipeline(stage: str) -> tuple[int, str, int]:
    """Return a sort key in execution order: all trials of one gripper (``verify-robotiq_2f85``) precede those of the next.

    Stages that are not part of the pipeline come last.
    """
    name, _, gripper = stage.partition("-")
    place = STAGE_ORDER.index(name) if name in STAGE_ORDER else len(STAGE_ORDER)
    first, last = STAGE_ORDER.index("grasps"), STAGE_ORDER.index("record_grasps")
    return (first if first <= place < last else place), gripper, place
