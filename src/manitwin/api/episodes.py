"""Make episodes with twins or in scenes, and render their videos."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from manitwin.api.settings import settings_of

if TYPE_CHECKING:
    from manitwin.engine.drive import RunOptions, RunReport
    from manitwin.episodes.collect import AttemptTotals
    from manitwin.episodes.lerobot.write import LeRobotSummary
    from manitwin.episodes.retirement import Retirement
    from manitwin.episodes.settings import PicturesConfig, TrajectoriesConfig


@dataclass(frozen=True)
class EpisodesReport:
    """The result of ``make_episodes``.

    ``totals`` holds the attempt counts and ``lines`` the same in words; they are None and empty if the run has not finished.
    ``retired`` lists all grasps that fail in episodes, ``newly_retired`` counts those that this call has retired.
    """

    run: RunReport
    totals: AttemptTotals | None = None
    lines: list[str] = field(default_factory=list)
    retired: list[Retirement] = field(default_factory=list)
    newly_retired: int = 0


def make_episodes(
    source: str | Path,
    out: str | Path,
    count: int = 100,
    *,
    config: TrajectoriesConfig | str | Path | None = None,
    twins: str | Path | None = None,
    formats: Iterable[str] = ("lerobot", "maniskill"),
    retire: bool = True,
    jobs: int | None = None,
    **run: Unpack[RunOptions],
) -> EpisodesReport:
    """Attempt ``count`` episodes of a skill with the twins of a data set or in scenes, and keep the successful ones.

    ``out`` receives ``attempts.parquet`` and one data set per format of ``formats`` (docs/episodes.md). Existing episodes are
    kept. ``twins``: the current location of the twins, if it has changed since the scenes were made. ``retire``: mark grasps
    that fail in the records of their twins. Raises UsageError for a source without twins or scenes, an unknown robot or format,
    an ``out`` that was made with other settings, or if another run is writing there.
    """
    from manitwin.episodes.collect import chosen_formats, collect
    from manitwin.episodes.episodes_run import make_episodes as make_batches
    from manitwin.episodes.episodes_run import retire_failing
    from manitwin.episodes.settings import TrajectoriesConfig

    settings, wanted = settings_of(TrajectoriesConfig, config, jobs), chosen_formats(formats)
    ended = make_batches(source, out, count, settings, twins=twins, **run)
    if ended.exit_code == 4:
        return EpisodesReport(ended)
    collected = collect(Path(out), wanted)
    retired, fresh = retire_failing(Path(out)) if retire else ([], 0)
    return EpisodesReport(ended, collected.totals, collected.lines, retired, fresh)


def render_episodes(
    episodes: str | Path,
    *,
    config: PicturesConfig | str | Path | None = None,
    twins: str | Path | None = None,
    jobs: int | None = None,
    on_written: Callable[[LeRobotSummary], None] = lambda summary: None,
    **run: Unpack[RunOptions],
) -> RunReport:
    """Render the successful episodes of a folder by replaying their recorded states, and write the LeRobot data set with videos.

    ``twins``: the current location of the twins. Episodes that are already rendered are not rendered again. Raises
    EpisodesError if there are no episodes, UsageError for an unknown camera, RendererMissing without a renderer, and
    Unavailable without a video encoder.
    """
    from manitwin.episodes.episode_pictures import render_batches, write_with_pictures
    from manitwin.episodes.settings import PicturesConfig
    from manitwin.episodes.video import require_encoder
    from manitwin.render.device import require_renderer

    settings = settings_of(PicturesConfig, config, jobs)
    if run.get("executor") != "ray":
        require_renderer()
        require_encoder(settings.codec)
    report = render_batches(Path(episodes), settings, twins=twins, **run)
    if report.exit_code != 4:
        on_written(write_with_pictures(Path(episodes), settings.cameras, settings.rate_hz))
    return report
