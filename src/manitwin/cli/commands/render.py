"""``manitwin render``: pictures of recorded episodes, and of a twin at positions of its joints."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manitwin.cli import option_values, options
from manitwin.cli.causes import print_causes
from manitwin.cli.console import err_console, out_console, print_error

if TYPE_CHECKING:
    from manitwin.episodes.lerobot.write import LeRobotSummary


@options.with_options({name: each for name, each in options.RUN.items() if name != "seed"})
def render(
    episodes: Annotated[
        Path,
        options.existing_path_argument(
            "A folder that `manitwin trajectories` wrote, or a twin.",
            "EPISODES|TWIN",
            "the folder that manitwin trajectories wrote, or a twin's",
        ),
    ],
    cameras: Annotated[
        str | None, option_values.CAMERAS.option(help="Cameras, separated by commas: front, side, top, wrist.")
    ] = None,
    size: Annotated[
        int | None, typer.Option(help="Width and height of a picture, in pixels.", min=64, max=2048)
    ] = None,
    codec: Annotated[
        str | None,
        option_values.CODECS.option(
            help="Video codec: av1 (plays in browsers), vp9 (also in older ones; slow to write) or mpeg4 (in none)."
        ),
    ] = None,
    rate_hz: Annotated[
        str | None,
        option_values.RATES_HZ.option(
            help="Frame rate of the LeRobot data set in Hz: 20, 10 or 5; lower rates cost less."
        ),
    ] = None,
    twins: options.Twins = None,
    joint: Annotated[
        list[str] | None,
        typer.Option(
            "--joint",
            help="Twin: position of a joint, in rad or m; may be repeated. Default: every joint at its limits.",
            metavar="NAME=VALUE",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Twin: file for the picture.", metavar="FILE.png")
    ] = None,
    **run: Any,
) -> None:
    """Render kept episodes by replaying their states, and add the videos to the LeRobot data set; or draw a twin's joints."""
    if (episodes / "twin.json").is_file():
        _draw_twin(episodes, joint, out, size)
        return
    if joint is not None or out is not None:
        from manitwin.errors import UsageError

        raise UsageError(f"{episodes}: not a twin; --joint and --out apply to a twin, give its folder")
    from manitwin.episodes.settings import PicturesConfig

    names = None if cameras is None else tuple(name.strip() for name in cameras.split(","))
    rate = None if rate_hz is None else int(rate_hz)
    settings = options.read_settings(
        PicturesConfig, run, {"cameras": names, "size_px": size, "codec": codec, "rate_hz": rate}
    )
    from manitwin.api import render_episodes
    from manitwin.cli.progress import RunDisplay
    from manitwin.episodes.episode_pictures import PICTURES

    written: list[LeRobotSummary] = []
    with RunDisplay("batches", episodes / PICTURES) as watched:
        report = render_episodes(
            episodes, config=settings, twins=twins, on_written=written.append,
            **options.executor_settings(run), **watched.callbacks,
        )  # fmt: skip
    for remark in report.remarks:
        err_console.print(remark)
    for each in written:
        out_console.print(
            f"{each.episodes} episodes, {each.frames} frames, {len(settings.cameras)} cameras: {episodes}/lerobot",
        )
    if report.exit_code == 4:
        if report.stopped:
            print_error(f"stopped: {report.stopped}")
        print_causes(f"{episodes}/pictures")
        if report.open:
            err_console.print(f"manitwin status {episodes}/pictures shows details; rerun the same command to resume")
        raise typer.Exit(4)


def _draw_twin(folder: Path, said: list[str] | None, out: Path | None, size: int | None) -> None:
    """Draw a twin at positions of its joints, where none is said each joint at its ends, into one PNG."""
    from manitwin.errors import UsageError

    if out is None or out.suffix.lower() != ".png":
        raise UsageError(f"{folder}: is a twin; give a file for its picture with --out FILE.png")
    positions = dict(_position(each) for each in said or ())
    from manitwin.render.device import require_renderer
    from manitwin.render.joint_states import PANEL_PX, draw_joint_states, representative_states
    from manitwin.twin.loaded_twin import Twin
    from manitwin.twin.store import write_bytes_atomically

    twin = Twin(folder)
    if not twin.record.joints:
        raise UsageError(f"{folder}: has no joints: it is one rigid body; its pictures are in {folder}/views")
    require_renderer()
    states = [positions] if positions else representative_states(twin)
    write_bytes_atomically(out, draw_joint_states(twin, states, size or PANEL_PX))
    out_console.print(f"{out}: {len(states)} states of {len(twin.record.joints)} joints")


def _position(said: str) -> tuple[str, float]:
    """Read ``NAME=VALUE``; raises UsageError."""
    from manitwin.errors import UsageError

    name, equals, value = said.rpartition("=")
    try:
        position = float(value)
    except ValueError:
        position = math.nan
    if not equals or not name or not math.isfinite(position):
        raise UsageError(
            f"--joint {said[:60]!r}: not the name and position of a joint; give NAME=VALUE, such as hinge=0.8"
        )
    return name, position
