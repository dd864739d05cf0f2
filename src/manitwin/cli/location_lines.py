"""What ``manitwin locate`` says: of each thing, of its grasps, and of the layout."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from manitwin.cli.console import out_console

if TYPE_CHECKING:
    from manitwin.scenes.locate.recognition import ViewedObject


def print_thing(thing: ViewedObject, name: str, is_one_of_many: bool) -> None:
    """Say where a thing is, or that it is not there."""
    location = thing.location
    if location.status == "none":
        alike = f" (and no other of {len(thing.tried)})" if is_one_of_many else ""
        out_console.print(f"not {name}{alike}: {location.reason}")
        return
    out_console.print(f"{name}: {location.status}; {location.reason}")
    for pose in location.poses:
        x, y, z = pose.object_to_camera[:3, 3]
        out_console.print(
            f"  score {pose.score:.3f}, {pose.visible_share:.0%} of it visible, at {x:.4f} {y:.4f} {z:.4f} m in the camera frame"
        )


def print_size(told: dict[str, Any] | None, grasps: bool) -> None:
    """Say which size was found, how far the shape is off, and what that means for grasps."""
    from manitwin.scenes.locate.size_fit import OTHER_SIZE, SAME_SIZE

    if told is None:
        return
    off = "" if told["shape_off_m"] is None else f"; median shape error {1e3 * told['shape_off_m']:.1f} mm"
    out_console.print(
        f"  {told['factor']:.3g} times the size of the twin ({told['low']:.3g} to {told['high']:.3g}){off}"
    )
    if grasps and abs(told["factor"] - 1) > SAME_SIZE:
        out_console.print(f"  no grasps: {OTHER_SIZE}")


def print_grasps(told: dict[str, Any] | None) -> None:
    """Say how many grasps are free, how many of them the robot reaches, and which is the best."""
    if told is None:
        return
    left = f"{told['obstructed']} are obstructed, {told['uncertain']} are not free in every candidate pose"
    out_console.print(
        f"  {len(told['free'])} of {told['verified']} verified grasps of {told['gripper']} are free; {left}"
    )
    if told["robot"] is not None:
        out_console.print(f"  {told['robot']} reaches {told['reached']} of these")
    for grasp in told["free"][:1]:
        x, y, z = grasp["position_m"]
        out_console.print(
            f"  best grasp {grasp['grasp_id']}: at {x:.4f} {y:.4f} {z:.4f} m, {grasp['width_m'] * 1e3:.0f} mm wide"
        )


def print_frames(functional: list[dict[str, Any]], placements: list[dict[str, Any]] | None) -> None:
    """Say where the functional points are, and in which of its resting poses the thing could lie there."""
    if placements is None:
        return
    for each in functional:
        x, y, z = each["position_m"]
        sure = "" if each["certain"] else ", elsewhere in another pose"
        out_console.print(f"  {each['label']}: at {x:.4f} {y:.4f} {z:.4f} m{sure}", markup=False)
    free, stands = [each for each in placements if each["free"]], [each for each in placements if each["stands"]]
    now = f"; the object is now in pose {stands[0]['placement']}" if stands else ""
    out_console.print(f"  {len(free)} of {len(placements)} resting poses are collision-free at its position{now}")


def print_layout(told: dict[str, Any] | None, out: Path | None) -> None:
    """Say what the layout has, or why there is none."""
    if told is None:
        return
    for each in told["objects"]:
        if each["as_boxes"] is not None:
            out_console.print(f"{each['name']} is represented by boxes in the layout: it {each['as_boxes']}")
    if told["scene"] is None:
        out_console.print(f"no layout: {told['reason']}")
        return
    rested = [each["moved_m"] for each in told["objects"] if each["moved_m"] is not None]
    most_mm = 1000 * max(rested)
    where = (
        "the origin is the robot base"
        if told["base"] == "given"
        else "the position of the robot base is assumed (give it with --base)"
    )
    out_console.print(
        f"layout of {len(rested)} objects and {told['obstacles']} boxes of other visible surfaces, in {out}; the objects rest at"
        f" most {most_mm:.1f} mm from where they were found; {where}"
    )
