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

    ``name``, ``units`` m|cm|mm|none|auto, ``up`` y|z|auto, ``longest_side_m`` (of length, width and height as it stands),
    ``license`` and ``attribution`` hold for all inputs whose manifest row does not say otherwise. Of one photo ``mask`` is a
    picture of the thing's outline, white where it is, and ``box_px`` where it is: left, top, right, bottom. Of each text
    ``count`` variations are made, which differ in what it leaves open. With ``views`` the inputs are photos of one thing, which
    becomes one twin; ``turns_deg`` is the camera's turn about the vertical in each, counter-clockwise seen from above, or
    ``poses`` a transforms.json or the folder of a COLMAP model that states their cameras, whose unit and up axis are then
    ``units`` and ``up``. With ``strict`` a manifest's column that nobody knows is an error. ``config`` None: what the data set
    was built with, else the defaults. ``flags`` are said on top of it: ``seed``; ``grippers``, names or .toml files, the first
    one's grasps are the twin's own; ``vlm``, ``generator`` and ``grasper`` choose backends (docs/backends.md); once services
    have charged ``max_cost_usd``, items that would cost more are left unfinished; ``record`` is a file that a VLM's answers are
    added to; ``require_agreement`` verifies only what a second engine holds too; ``second_opinion`` "sample" tries 20 of the
    held grasps there instead of all; ``quick`` leaves out second engine and robustness; ``link`` asks of things with joints,
    which are locked, for grasps that touch this link with both fingertips. ``executor`` is local (``jobs`` processes), ray (a
    cluster at ``address``), or inline, in this process.

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
        config=config,         defaults=defaults, flags=flags,
    )  # fmt: skip
    from manitwin.dataset.build import build_requested

    return build_requested(
        request, executor=executor, address=address, on_estimate=on_estimate, on_start=on_start, on_stage=on_stage,
        on_result=on_result,
    )  # fmt: skip
