"""``manitwin gripper``: what a gripper's file says, checked, and how the gripper looks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import option_values
from manitwin.cli.console import out_console
from manitwin.cli.documents import Json, print_document
from manitwin.cli.output_file import write_output

if TYPE_CHECKING:
    from manitwin.robots.grippers.gripper import Gripper


def gripper(
    name: Annotated[
        str, option_values.GRIPPERS.argument(help="Name of a shipped gripper, or a .toml file.", metavar="GRIPPER")
    ],
    draw: Annotated[
        Path | None,
        typer.Option(
            "--draw",
            help="PNG file to draw the gripper into: open, closed and from an oblique view.",
            metavar="FILE.png",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Check a gripper file for consistency with its URDF, print the gripper that it defines, and draw it."""
    from manitwin.cli.gripper_facts import gripper_document, gripper_lines, hand_lines, posture_facts
    from manitwin.errors import UsageError
    from manitwin.robots.grippers.gripper import load_gripper
    from manitwin.robots.grippers.multi_finger import MultiFingerGripper

    if draw is not None and draw.suffix.lower() != ".png":
        raise UsageError(f"--draw {draw}: the picture is written as PNG; give a name that ends in .png")
    try:
        loaded = load_gripper(name)
    except UsageError:
        if draw is not None:  # what is wrong is best seen; a file that cannot be drawn either raises the same
            _draw(load_gripper(name, checked=False), draw)
        raise
    postures = posture_facts(loaded) if isinstance(loaded, MultiFingerGripper) else []
    if not json:
        for line in gripper_lines(loaded):
            out_console.print(line)
        if isinstance(loaded, MultiFingerGripper):
            for line in hand_lines(loaded, postures):
                out_console.print(line)
    if draw is not None:
        _draw(loaded, draw)
    if json:
        print_document(gripper_document(loaded, postures, None if draw is None else str(draw)))


def _draw(loaded: Gripper, file: Path) -> None:
    write_output(file, _picture(loaded))
    out_console.print(f"drawn to {file}: arrows X red, Y green, Z blue; the ball is tip_depth_m in front of the base")


def _picture(loaded: Gripper) -> bytes:
    import io

    from manitwin.render.gripper_picture import gripper_picture

    content = io.BytesIO()
    gripper_picture(loaded).save(content, "PNG")
    return content.getvalue()
