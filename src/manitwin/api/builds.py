"""Build twins from inputs, as ``manitwin build`` does."""

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

    Without inputs a build goes on with what is there. What was built under the same configuration and seed is not built again;
    under another one, the inputs that are given are (where none is given, all that are there), from the first stage that
    it changes.

    What a manifest's row may say for one input, these say for all others:

    - ``name``, ``license``, ``attribution``; ``units`` m|cm|mm|none|auto and ``up`` y|z|auto of meshes
    - ``longest_side_m``: the longest of length, width and height as the thing stands
    - ``mask``: a picture of the thing's outline in one photo, white where it is; ``box_px``: left, top, right, bottom of it

    What the inputs are:

    - ``count``: so many variations of each text, which differ in what it leaves open
    - ``views``: they are photos of one thing, which becomes one twin. ``turns_deg`` are the camera's turns about the vertical in
      these, counter-clockwise seen from above; or ``poses`` is a transforms.json or the folder of a COLMAP model that states
      the cameras, whose unit and up axis are then ``units`` and ``up``
    - ``strict``: a column of a manifest that nobody knows is an error

    ``config`` None is what the data set was built with, else the defaults. ``flags`` change it:

    - ``seed``; ``grippers``, names or .toml files, the first one's grasps are the twin's own
    - ``vlm``, ``generator``, ``grasper`` and ``matting`` choose backends (docs/backends.md); ``record`` is a file that a VLM's
      answers are added to
    - ``max_cost_usd``: once services have charged so much, items that would cost more are left unfinished
    - ``require_agreement`` verifies only grasps that a second engine holds too; ``second_opinion`` "sample" tries 20 of the held
      ones there instead of all; ``quick`` leaves out second engine, robustness and second trials of
      doubtful grasps
    - ``link``: of things with joints, which are locked, both fingertips of each grasp touch this link

    ``executor`` is local (``jobs`` processes), ray (a cluster at ``address``), or inline, in this process. ``on_estimate`` is
    called with about what services charge for a twin (USD) by the kind of its input, ``on_start`` with the number of items and of
    those that are to be done, ``on_stage`` and ``on_result`` with each event of a stage and each item that has ended.

    Raises UsageError for wrong arguments, and where another build is at work there; what happens to one item is in the report
    and never raised.
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
