"""``manitwin capture``: a folder with what a depth camera sees, or would see of a drawn layout."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import out_console


def capture(
    out: Annotated[Path, options.new_folder("A new folder for depth.png, rgb.png and camera.json.")],
    scene: Annotated[
        Path | None,
        typer.Option(
            help="Folder of a drawn scene to use instead of a camera; sensor noise is added to its depth.",
            metavar="SCENE",
            callback=option_values.existing_path_callback("a scene's folder"),
        ),
    ] = None,
    camera: Annotated[str, typer.Option(help="With --scene: which camera of the scene.")] = "oblique",
    seed: Annotated[
        int, typer.Option(help="With --scene: the random seed of the noise.", min=0, max=options.LARGEST_SEED)
    ] = 0,
    bag: Annotated[
        Path | None,
        typer.Option(
            help="Recording of a RealSense camera (.bag) to use instead of a camera.",
            metavar="FILE",
            callback=option_values.existing_path_callback("a recorded .bag"),
        ),
    ] = None,
    serial: Annotated[
        str | None, typer.Option(help="Serial number of the RealSense camera, if several are connected.")
    ] = None,
) -> None:
    """Save a frame of a RealSense camera for manitwin locate --view, or simulate one from a drawn scene."""
    from manitwin.errors import UsageError
    from manitwin.scenes.locate.capture_folder import write_capture
    from manitwin.scenes.locate.realsense import capture_view, sdk
    from manitwin.scenes.locate.simulated_capture import capture_of_scene

    given = [name for name, each in (("--scene", scene), ("--bag", bag), ("--serial", serial)) if each is not None]
    if len(given) > 1:
        raise UsageError(f"{' and '.join(given)} name different sources; give only one")
    seen = capture_view(sdk(), bag=bag, serial=serial) if scene is None else capture_of_scene(scene, camera, seed)
    write_capture(out, seen)
    height, width = seen.depth_m.shape
    share = float((seen.depth_m > 0).mean())
    out_console.print(f"{out}: {width} x {height} pixels, {share:.0%} with a depth, by {seen.device}")
    if seen.masks:
        out_console.print(f"masks of {', '.join(seen.masks)}")
