"""Build twins from Python, as the command ``manitwin build`` does."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

if TYPE_CHECKING:
    from manitwin.config import BuildConfig
    from manitwin.engine.drive import ExecutorName
    from manitwin.engine.events import OnStage
    from manitwin.pipeline.build_report import BuildReport, ItemResult
    from manitwin.pipeline.settings import Flags


def build(
    inputs: str | Path | Iterable[str | Path],
    out: str | Path,
    *,
    texts: Iterable[str] = (),
    name: str | None = None,
    units: str = "auto",
    up: str = "auto",
    longest_side_m: float | None = None,
    mask: str | Path | None = None,
    box_px: Sequence[float] | None = None,
    license: str | None = None,
    attribution: str | None = None,
    count: int = 1,
    views: bool = False,
    turns_deg: Sequence[float] | None = None,
    poses: str | Path | None = None,
    strict: bool = False,
    jobs: int | None = None,
    config: BuildConfig | str | Path | None = None,
    executor: ExecutorName = "local",
    address: str | None = None,
    on_estimate: Callable[[dict[str, float]], None] = lambda usd_by_kind: None,
    on_start: Callable[[int, int], None] = lambda items, opened: None,
    on_stage: OnStage = lambda event: None,
    on_result: Callable[[ItemResult], None] = lambda result: None,
    **flags: Unpack[Flags],
) -> BuildReport:
    """Build twins from images, meshes, folders, manifests and ``texts`` into the data set ``out``, a folder or a URL.

    Without inputs, the build resumes the items that the data set already has. An item that was built with the same
    configuration and seed is not built again. If the configuration has changed, the given inputs (without inputs: all items)
    are rebuilt from the first stage that the change affects.

    Default values of manifest columns, for inputs that do not state their own:

    - ``name``, ``license``, ``attribution``; for meshes ``units`` (m|cm|mm|none|auto) and ``up`` (y|z|auto)
    - ``longest_side_m``: the largest of length, width and height of the object as it stands
    - ``mask``: mask image of the object in one photo, white on the object; ``box_px``: its bounding box as left, top, right,
      bottom

    Interpretation of the inputs:

    - ``count``: number of variations built from each text; they differ in what the text leaves open
    - ``views``: the inputs are photos of one object and make one twin. ``turns_deg`` gives the camera's rotation about the
      vertical for each photo, counter-clockwise seen from above. Alternatively ``poses`` is a transforms.json file or a COLMAP
      model folder with the cameras; ``units`` and ``up`` then describe that file
    - ``strict``: an unknown manifest column is an error

    ``config`` None takes the configuration that the data set was built with, or else the defaults. ``flags`` override it:

    - ``seed``; ``grippers``: names or .toml files; the grasps of the first gripper are the twin's own
    - ``vlm``, ``generator``, ``grasper``, ``matting``: backends (docs/backends.md); ``record``: a file to which all VLM answers
      are appended
    - ``max_cost_usd``: items whose next paid stage would exceed this sum are left unfinished
    - ``require_agreement``: verify only grasps that a second engine confirms; ``second_opinion`` "sample": try 20 of the
      successful grasps there instead of all; ``quick``: skip the second engine, the robustness trials and the second trials of
      doubtful grasps
    - ``link``: for articulated objects, whose joints are locked: both fingertips of each grasp must touch this link

    ``executor`` is "local" (``jobs`` processes), "ray" (a cluster at ``address``) or "inline" (this process).

    Callbacks: ``on_estimate`` gets the approximate service cost of a twin in USD by kind of input, ``on_start`` the number of
    items and how many of them are to be built, ``on_stage`` each event of a stage, ``on_result`` each item that has ended.

    Raises UsageError for invalid arguments and if another build is writing to ``out``. Failures of single items are never
    raised; they are in the report.
    """
    from manitwin.pipeline.settings import request_build

    defaults = {
        "name": name,
        "units": units,
        "up": up,
        "longest_side_m": longest_side_m,
        "mask": mask,
        "box_px": box_px,
        "license": license,
        "attribution": attribution,
    }
    request = request_build(
        inputs, out, texts=texts, count=count, views=views, turns_deg=turns_deg, poses=poses, strict=strict, jobs=jobs,
        config=config, defaults=defaults, flags=flags,
    )  # fmt: skip
    from manitwin.dataset.build import build_requested

    return build_requested(
        request, executor=executor, address=address, on_estimate=on_estimate, on_start=on_start, on_stage=on_stage,
        on_result=on_result,
    )  # fmt: skip
