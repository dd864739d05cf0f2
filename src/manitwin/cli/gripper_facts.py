"""What a gripper's file comes to, as lines for a person and as a document for programs."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from manitwin.robots.grippers.gripper import Gripper
    from manitwin.robots.grippers.multi_finger import MultiFingerGripper, Posture

SHOWN_ROWS = 5
NOTED_TILT_DEG = 20.0
"""Beyond this a fingertip with a friction coefficient of 0.36 slips along what is held."""


@dataclass(frozen=True)
class PostureAtOpening:
    """The fingertips at one opening of a posture, as the links of the URDF have them, in the grasp frame.

    ``gap_m`` is the room along X between the tips, ``reach_m`` how far along +Z they reach, ``centers_m`` their centres
    ``(F, 3)``, the thumb's first.
    """

    opening_m: float
    gap_m: float
    reach_m: float
    centers_m: list[list[float]]


@dataclass(frozen=True)
class PostureFacts:
    """A posture of a hand at several openings; ``tilt_rad`` is how far off X thumb and fingers oppose when half open."""

    name: str
    grasp_types: list[str]
    depth_m: list[float]
    openings: list[PostureAtOpening]
    tilt_rad: float


def posture_facts(hand: MultiFingerGripper) -> list[PostureFacts]:
    """Return where the links of a hand's URDF have its fingertips in each of its postures."""
    from manitwin.robots.grippers.fingertip_gaps import Fingertips

    tips = Fingertips(hand)
    return [_posture_facts(tips, posture) for posture in hand.postures]


def _posture_facts(tips: Any, posture: Posture) -> PostureFacts:
    from manitwin.robots.grippers.posture_checks import opposition_tilt_rad, posture_gaps_m, posture_reach_m

    openings_m = np.linspace(max(0.0, posture.openings_m[0]), posture.openings_m[-1], SHOWN_ROWS)
    rows = posture.joints_at(openings_m)
    each = zip(openings_m, posture_gaps_m(tips, rows), posture_reach_m(tips, rows), rows, strict=True)
    return PostureFacts(
        posture.name,
        list(posture.grasp_types),
        list(map(float, posture.depth_m)),
        [
            PostureAtOpening(float(opening_m), float(gap_m), float(reach_m), tips.centers_m(row).tolist())
            for opening_m, gap_m, reach_m, row in each
        ],
        float(opposition_tilt_rad(tips, rows)),
    )


def gripper_document(gripper: Gripper, postures: list[PostureFacts], picture: str | None) -> dict[str, Any]:
    """Return the document of a gripper, which says what the lines say; ``picture`` is the file that it was drawn to."""
    return {
        "name": gripper.name,
        "kind": gripper.kind,
        "source": gripper.source,
        "sha256": gripper.sha256,
        "opening_m": None if gripper.kind == "suction" else gripper.opening_m,
        "tip_depth_m": gripper.tip_depth_m,
        "force_n": gripper.force_n,
        "finger_friction": gripper.finger_friction,
        "joints": list(getattr(gripper, "joints", ())),
        "postures": [asdict(each) for each in postures],
        "remarks": [note for each in postures if (note := tilt_note(each)) is not None],
        "picture": picture,
    }


def gripper_lines(gripper: Gripper) -> list[str]:
    """Return lines on what it is, what it holds and how."""
    thickest = "any width" if gripper.kind == "suction" else f"up to {1000 * gripper.opening_m:.0f} mm"
    return [
        f"{gripper.name}: {gripper.kind}, {gripper.source}",
        f"holds objects of {thickest} with {gripper.force_n:.3g} N, friction {gripper.finger_friction:g}; its tips are"
        f" {1000 * gripper.tip_depth_m:.0f} mm in front of its base",
    ]


def hand_lines(hand: MultiFingerGripper, postures: list[PostureFacts]) -> list[str]:
    """Return lines on the joints and postures of a hand."""
    lines = [f"{len(hand.joints)} joints: {', '.join(hand.joints)}"]
    for posture in postures:
        lines.append(
            f"posture {posture.name}, for {', '.join(posture.grasp_types)}: holds at a depth of"
            f" {_span(np.array(posture.depth_m))} mm"
        )
        for at in posture.openings:
            thumb, fingers = np.array(at.centers_m[0]), np.array(at.centers_m[1:])
            lines.append(
                f"  opening {1000 * at.opening_m:4.0f} mm: {round(1000 * at.gap_m):4d} mm along X between the tips, which reach"
                f" depth {1000 * at.reach_m:.0f}; thumb at x {1000 * thumb[0]:.0f}, z {1000 * thumb[2]:.0f}, fingers at x"
                f" {_span(fingers[:, 0])}, z {_span(fingers[:, 2])}"
            )
        note = tilt_note(posture)
        if note is not None:
            lines.append(f"  note: {note}")
    return lines


def tilt_note(posture: PostureFacts) -> str | None:
    """Return what mends a posture whose thumb and fingers oppose aslant; None where they oppose along X."""
    tilt_deg = float(np.rad2deg(posture.tilt_rad))
    if abs(tilt_deg) <= NOTED_TILT_DEG:
        return None
    return (
        f"half open, the line from the thumb to the fingers is {abs(tilt_deg):.0f} degrees off X, the closing"
        f" direction; turn root_to_gripper by {posture.tilt_rad:.2f} rad about Y, or choose other positions"
    )


def _span(values_m: np.ndarray) -> str:
    low, high = (f"{1000 * value:.0f}" for value in (values_m.min(), values_m.max()))
    return low if low == high else f"{low} to {high}"
