"""``manitwin render``: pictures of recorded episodes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manitwin.cli import choices, options
from manitwin.cli.causes import print_causes
from manitwin.cli.console import err_console, out_console, print_error

if TYPE_CHECKING:
    from manitwin.episodes.lerobot.write import LeRobotSummary


@options.with_options({name: each for name, each in options.RUN.items() if name != "seed"})
def render(
    episodes: Annotated[
        Path,
        options.existing(
            "What `manitwin trajectories` wrote.", "EPISODES", "the folder that manitwin trajectories wrote"
        ),
    ],
    cameras: Annotated[str | None, choices.CAMERAS.option(help="By commas: front, side, top, wrist.")] = None,
    size: Annotated[int | None, typer.Option(help="Width and height of a picture in pixels.", min=64, max=2048)] = None,
    codec: Annotated[
        str | None, choices.CODECS.option(help="vp9 (plays in browsers), or mpeg4 (quicker to write).")
    ] = None,
    twins: options.Twins = None,
    **run: Any,
) -> None:
    """Draw the kept episodes by showing their states again, and add the films to the LeRobot data set."""
    from manitwin.episodes.settings import PicturesConfig

    names = None if cameras is None else tuple(name.strip() for name in cameras.split(","))
    settings = options.read_settings(PicturesConfig, run, {"cameras": names, "size_px": size, "codec": codec})
    from manitwin.api import render_episodes
    from manitwin.cli.progress import WatchedRun
    from manitwin.episodes.episode_pictures import PICTURES

    written: list[LeRobotSummary] = []
    with WatchedRun("batches", episodes / PICTURES) as watched:
        report = render_episodes(
            episodes, config=settings, twins=twins, on_written=written.append,
            **options.placed(run), **watched.callbacks,
        )  # fmt: skip
    for each in written:
        out_console.print(
            f"{each.episodes} episodes, {each.frames} frames, {len(settings.cameras)} cameras: {episodes}/lerobot",
        )
    if report.exit_code == 4:
        if report.stopped:
            print_error(f"stopped: {report.stopped}")
        print_causes(f"{episodes}/pictures")
        if report.open:
            err_console.print(f"manitwin status {episodes}/pictures says more; run the same command again")
        raise typer.Exit(4)
