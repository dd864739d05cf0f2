"""``manitwin render``: pictures of recorded episodes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manitwin.cli import choices, options
from manitwin.cli.causes import print_causes
from manitwin.cli.console import err_console, out_console, print_error


def render(
    episodes: Annotated[
        Path,
        typer.Argument(
            help="What `manitwin trajectories` wrote.",
            metavar="EPISODES",
            callback=choices.must_exist("the folder that manitwin trajectories wrote"),
        ),
    ],
    cameras: Annotated[str | None, choices.CAMERAS.option(help="By commas: front, side, top, wrist.")] = None,
    size: Annotated[int | None, typer.Option(help="Width and height of a picture in pixels.")] = None,
    codec: Annotated[
        str | None, choices.CODECS.option(help="vp9 (plays in browsers), or mpeg4 (quicker to write).")
    ] = None,
    twins: options.Twins = None,
    config: options.Config = None,
    jobs: options.Jobs = None,
    executor: options.Executor = "local",
    address: options.Address = None,
) -> None:
    """Draw the kept episodes by showing their states again, and add the films to the LeRobot data set."""
    from manitwin.episodes.settings import PicturesConfig
    from manitwin.scenes.run_settings import load_settings

    names = None if cameras is None else tuple(name.strip() for name in cameras.split(","))
    given = {"cameras": names, "size_px": size, "codec": codec, "run": options.run_settings(jobs)}
    settings = load_settings(PicturesConfig, config, given)
    from manitwin.cli.progress import WatchedRun
    from manitwin.engine.ledger.location import local_log
    from manitwin.episodes.episode_pictures import PICTURES, draw_episodes, write_with_pictures
    from manitwin.episodes.video import require_encoder
    from manitwin.render.device import require_renderer
    from manitwin.twin.dataset_root import DatasetRoot

    if executor != "ray":
        require_renderer()
        require_encoder(settings.codec)
    with WatchedRun("batches", lambda: local_log(DatasetRoot(episodes / PICTURES))) as watched:
        report = draw_episodes(
            episodes, settings, twins=twins, executor=options.executor_name(executor), address=address,
            on_start=watched.start, on_stage=watched.progress.stage, on_ended=watched.progress.item_ended,
        )  # fmt: skip
    if report.exit_code == 4:
        if report.stopped:
            print_error(f"stopped: {report.stopped}")
        print_causes(f"{episodes}/pictures")
        if report.open:
            err_console.print(
                f"manitwin status {episodes}/pictures says more; run the same command again", markup=False
            )
        raise typer.Exit(4)
    written = write_with_pictures(episodes, settings.cameras)
    out_console.print(
        f"{written.episodes} episodes, {written.frames} frames, {len(settings.cameras)} cameras: {episodes}/lerobot",
        markup=False,
    )
