"""Postures of a multi-finger hand: construction from a closed and an open row, and checks against the links of its URDF."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from manitwin.robots.grippers.fingertip_gaps import Fingertips
from manitwin.robots.grippers.multi_finger import MultiFingerGripper, Posture

STEPS = 24
"""Samples between open and closed; the gap is assumed to change linearly between two samples."""
LIMIT_TOLERANCE = 1e-3
"""Tolerance, because positions and limits are rounded to three digits."""
LEAST_TRAVEL_M = 0.001


def measured_posture(tips: Fingertips, posture: Posture) -> Posture:
    """Return a posture of two rows, closed and open, with openings measured between the fingertips at samples in between.

    Raises ValueError if thumb and fingers do not approach each other.
    """
    closed, opened = np.array(posture.joints_rad)
    rows = closed + np.linspace(0, 1, STEPS + 1)[:, None] * (opened - closed)
    gaps_m = posture_gaps_m(tips, rows)
    last = int(np.argmax(gaps_m))
    if gaps_m[last] - gaps_m[0] < LEAST_TRAVEL_M:
        raise ValueError(_not_closing(posture.name, float(gaps_m[0]), float(gaps_m[-1]), "closed_rad", "open_rad"))
    kept = [int(np.argmin(gaps_m[: last + 1]))]
    for index in range(kept[0] + 1, last + 1):
        if gaps_m[index] > gaps_m[kept[-1]]:
            kept.append(index)
    joints_rad = tuple(map(tuple, rows[kept].tolist()))
    return replace(posture, openings_m=tuple(gaps_m[kept].tolist()), joints_rad=joints_rad)


def posture_gaps_m(tips: Fingertips, joints_rad: np.ndarray) -> np.ndarray:
    """Return the smallest gap along X between the thumb and the active fingers, for each row ``(K,)`` of joints ``(K, J)``.

    A finger is active if its tip moves at least half as far from the first to the last row as that of the finger that moves
    most.
    """
    gaps_m = np.array([tips.gaps_m(row) for row in joints_rad])
    return np.asarray(gaps_m[:, _active_fingers(tips, joints_rad)].min(axis=1))


def posture_reach_m(tips: Fingertips, joints_rad: np.ndarray) -> np.ndarray:
    """Return how far along +Z both the thumb and the active fingers reach, for each row, ``(K,)``."""
    reach_m = np.array([tips.reach_m(row) for row in joints_rad])
    return np.minimum(reach_m[:, 0], reach_m[:, 1:][:, _active_fingers(tips, joints_rad)].max(axis=1))


def opposition_tilt_rad(tips: Fingertips, joints_rad: np.ndarray) -> float:
    """Return the angle from X towards Z of the line from the thumb to the active fingers, in the middle row.

    Rotating ``root_to_gripper`` by this angle about Y aligns the line with X, the closing direction.
    """
    centers_m = tips.centers_m(joints_rad[len(joints_rad) // 2])
    across_m = centers_m[1:][_active_fingers(tips, joints_rad)].mean(0) - centers_m[0]
    return float(np.arctan2(across_m[2], across_m[0]))


def _active_fingers(tips: Fingertips, joints_rad: np.ndarray) -> np.ndarray:
    """Tell which fingers except the thumb are active, ``(F - 1,)`` bool."""
    moved = np.ptp(np.array([tips.centers_m(row) for row in (joints_rad[0], joints_rad[-1])]), axis=0)
    travel = np.linalg.norm(moved[1:], axis=-1)
    return np.asarray(travel >= travel.max() / 2)


def check_fingers(hand: MultiFingerGripper) -> None:
    """Raise ValueError if there are fewer than two fingers, if fingers share a link, or if one has no movable joint."""
    if len(hand.fingers) < 2:
        raise ValueError("fingers: there are fewer than two; name the links of the thumb, then those of each finger")
    twice = [name for name, count in Counter(name for finger in hand.fingers for name in finger).items() if count > 1]
    if twice:
        raise ValueError(f"fingers: {', '.join(twice)} is listed twice; a link belongs to one finger")
    moving = {link.name for link in hand.links if link.joint_type != "fixed"}
    for number, finger in enumerate(hand.fingers):
        if not moving & set(finger):
            raise ValueError(
                f"fingers: none of the joints that hold {', '.join(finger) or 'finger ' + str(number)} moves; name the links"
                " that turn, or leave this finger out"
            )


def check_positions(hand: MultiFingerGripper, tips: Fingertips, posture: Posture) -> None:
    """Raise ValueError if a posture exceeds joint limits, moves the palm, or has the thumb on the wrong side."""
    rows = np.array(posture.joints_rad)
    owner = dict(zip((link.joint for link in hand.links), hand.finger_of_link, strict=True))
    limits = {link.joint: link.limits for link in hand.links}
    where = f"posture {posture.name!r}"
    for column, joint in zip(rows.T, hand.joints, strict=True):
        low, high = limits[joint]
        if column.min() < low - LIMIT_TOLERANCE or column.max() > high + LIMIT_TOLERANCE:
            worst = column[np.argmax(np.maximum(low - column, column - high))]
            raise ValueError(
                f"{where}: joint {joint!r} is at {worst:g}, its limits in the URDF are {low:g} to {high:g} rad;"
                f" correct the position (positions are in the order of joints)"
            )
        if owner[joint] < 0 and np.ptp(column) > LIMIT_TOLERANCE:
            raise ValueError(
                f"{where}: joint {joint!r} moves, but its link belongs to no finger; list that link under fingers, or"
                " keep the joint at one position"
            )
    centers = tips.centers_m(rows[-1])
    thumb, fingers = centers[0], centers[1:].mean(0)
    if thumb[0] >= fingers[0]:
        raise ValueError(
            f"{where}: the thumb's tip is at x = {thumb[0]:.3f} of the grasp frame, the fingers' at {fingers[0]:.3f}; the thumb"
            " belongs on -X: name it first under fingers, or turn root_to_gripper about Z"
        )
    if max(thumb[2], fingers[2]) <= hand.palm_front_m:
        raise ValueError(
            f"{where}: the fingertips are at z = {fingers[2]:.3f} of the grasp frame, the palm's front at"
            f" {hand.palm_front_m:.3f}; +Z points out of the palm: turn root_to_gripper, or correct palm_front_m"
        )


def check_closing(hand: MultiFingerGripper, tips: Fingertips, posture: Posture) -> None:
    """Raise ValueError if a posture does not close, opens less than stated, or holds deeper than its fingertips reach."""
    where, rows = f"posture {posture.name!r}", np.array(posture.joints_rad)
    closed_m, open_m = posture_gaps_m(tips, rows[[0, -1]])
    if open_m - closed_m < LEAST_TRAVEL_M:
        raise ValueError(_not_closing(posture.name, closed_m, open_m, "the first row", "the last"))
    least_m = posture.openings_m[-1] - 2 * hand.clearance_m
    if open_m < least_m:
        raise ValueError(
            f"{where}: its widest opening is said to be {posture.openings_m[-1]:.4g} m, thumb and fingers of the URDF are then"
            f" {open_m:.4g} m apart along X; correct openings_m, or give closed_rad and open_rad, between which"
            f" they are measured"
        )
    reach_m = float(posture_reach_m(tips, rows).max())
    if posture.depth_m[1] > reach_m:
        raise ValueError(
            f"{where}: depth_m ends at {posture.depth_m[1]:g}, thumb and fingers reach to {reach_m:.3f} along +Z in"
            f" it, and would close behind the object; give less, or correct root_to_gripper"
        )


def _not_closing(name: str, closed_m: float, open_m: float, closed: str, opened: str) -> str:
    return (
        f"posture {name!r}: thumb and fingers do not come nearer as it closes, they are {closed_m:.4g} m apart along X in"
        f" {closed} and {open_m:.4g} m in {opened}; check the signs of the positions: each joint turns about its <axis>"
    )
