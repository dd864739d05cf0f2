"""``manitwin gripper``: what a gripper's file says, checked, and how the gripper looks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import choices
from manitwin.cli.console import out_console
from manitwin.cli.output_file import write_output

if TYPE_CHECKING:
    import numpy as np

    from manitwin.robots.grippers.gripper import Gripper
    from manitwin.robots.grippers.multi_finger import MultiFingerGripper

SHOWN_ROWS = 5
NOTED_TILT_DEG = 20.0
"""Beyond this a fingertip with a friction coefficient of 0.36 slips along what is held."""


def gripper(
    name: Annotated[str, choices.GRIPPERS.argument(help="A shipped name, or a .toml file.", metavar="GRIPPER")],
    draw: Annotated[
        Path | None,
        typer.Option("--draw", help="Draw it open, closed and from an oblique view.", metavar="FILE.png"),
    ] = None,
) -> None:
    """Check a gripper's file against itself and its URDF, say what it makes of it, and draw it."""
    from manitwin.errors import UsageError
    from manitwin.robots.grippers.gripper import load_gripper
    from manitwin.robots.grippers.multi_finger import MultiFingerGripper

    if draw is not None and draw.suffix.lower() != ".png":
        raise UsageError(f"--draw {draw}: a picture is written as PNG; give a name that ends in .png")
    try:
        loaded = load_gripper(name)
    except UsageError:
        if draw is not None:  # what is wrong is best seen; a file that cannot be drawn either raises the same
            _draw(load_gripper(name, checked=False), draw)
        raise
    for line in [*_facts(loaded), *(_postures(loaded) if isinstance(loaded, MultiFingerGripper) else ())]:
        out_console.print(line)
    if draw is not None:
        _draw(loaded, draw)


def _draw(loaded: Gripper, file: Path) -> None:
    write_output(file, _picture(loaded))
    out_console.print(f"drawn to {file}: arrows X red, Y green, Z blue; the ball is tip_depth_m in front of the base")


def _facts(loaded: Gripper) -> list[str]:
    thickest = "any width" if loaded.kind == "suction" else f"up to {1000 * loaded.opening_m:.0f} mm"
    return [
        f"{loaded.name}: {loaded.kind}, {loaded.source}",
        f"holds things of {thickest} with {loaded.force_n:.3g} N, friction {loaded.finger_friction:g}; its tips are"
        f" {1000 * loaded.tip_depth_m:.0f} mm in front of its base",
    ]


def _postures(hand: MultiFingerGripper) -> list[str]:
    """Return lines on joints and postures, with where the links of the URDF have the fingertips."""
    import numpy as np

    from manitwin.robots.grippers.fingertip_gaps import Fingertips
    from manitwin.robots.grippers.posture_checks import (
        opposition_tilt_rad,
        posture_gaps_m,
        posture_reach_m,
    )

    tips = Fingertips(hand)
    lines = [f"{len(hand.joints)} joints: {', '.join(hand.joints)}"]
    for posture in hand.postures:
        openings_m = np.linspace(max(0.0, posture.openings_m[0]), posture.openings_m[-1], SHOWN_ROWS)
        rows = posture.joints_at(openings_m)
        lines.append(
            f"posture {posture.name}, for {', '.join(posture.grasp_types)}: holds at a depth of"
            f" {_span(np.array(posture.depth_m))} mm"
        )
        gaps_m, reach_m = posture_gaps_m(tips, rows), posture_reach_m(tips, rows)
        for opening_m, gap_m, end_m, row in zip(openings_m, gaps_m, reach_m, rows, strict=True):
            centers_m = tips.centers_m(row)
            thumb, fingers = centers_m[0], centers_m[1:]
            lines.append(
                f"  opening {1000 * opening_m:4.0f} mm: {round(1000 * gap_m):4d} mm along X between the tips, which reach depth"
                f" {1000 * end_m:.0f}; thumb at x {1000 * thumb[0]:.0f}, z {1000 * thumb[2]:.0f}, fingers at x"
                f" {_span(fingers[:, 0])}, z {_span(fingers[:, 2])}"
            )
        tilt_deg = float(np.rad2deg(opposition_tilt_rad(tips, rows)))
        if abs(tilt_deg) > NOTED_TILT_DEG:
            lines.append(
                f"  note: half open, the line from the thumb to the fingers is {abs(tilt_deg):.0f} degrees off X, along which"
                f" things are held; turn root_to_gripper by {np.deg2rad(tilt_deg):.2f} rad about Y, or choose other positions"
            )
    return lines


def _span(values_m: np.ndarray) -> str:
    low, high = (f"{1000 * value:.0f}" for value in (values_m.min(), values_m.max()))
    return low if low == high else f"{low} to {high}"


def _picture(loaded: Gripper) -> bytes:
    import io

    from manitwin.render.gripper_picture import gripper_picture

    content = io.BytesIO()
    gripper_picture(loaded).save(content, "PNG")
    return content.getvalue()
