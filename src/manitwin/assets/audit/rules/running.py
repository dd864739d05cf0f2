"""RUN rules: defects that only simulation shows, in the engines of ``--engines``."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, combinations, islice

import numpy as np

from manitwin.assets.audit.ball_runs import drop_balls
from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.engine_runs import DropRun, DropRuns, run_drops
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.joint_runs import run_free_joints
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.assets.audit.rules.collision import filled_opening, has_convex_pieces
from manitwin.assets.audit.rules.parts import linkage_error

SUNK_M, SUNK_SHARE = 0.003, 0.03
"""Tolerated depth below the plane or difference in height, in metres and as share of the longest side: exceeds soft contact."""

TURNED_RAD = np.deg2rad(10.0)
"""A body that rests on the same points in both runs rotates by less."""


def not_run(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report that the asset could not be simulated."""
    if not measured.engines:
        return
    dropped = measured.measure_once(run_drops)
    if dropped.body is None:
        yield Complaint(f"not run in {', '.join(measured.engines)}: {dropped.why_not}")
    why_not = linkage_error(measured)
    if why_not:
        yield Complaint(f"its parts were not held against each other: {why_not}")


def refused(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report engines that refuse the body, or whose simulation diverges."""
    for run in _drop_runs(measured).runs:
        if run.refused:
            yield Complaint(f"{run.engine} does not run it: {run.refused}", values=_values(run))


def leaves_plane(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a body that ends below the plane, or in the air."""
    dropped = _drop_runs(measured)
    for run in _finished_runs(dropped):
        lowest_m = dropped.lowest_m(run)
        if abs(lowest_m) > _slack_m(measured):
            where = "below" if lowest_m < 0 else "above"
            yield Complaint(
                f"in {run.engine} it ends {1000 * abs(lowest_m):.3g} mm {where} the plane that it was put on",
                values={**_values(run), "lowest_m": lowest_m},
            )
            return


def jitters(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a body that neither moves away nor comes to rest; one that rolls away is ignored."""
    dropped = _drop_runs(measured)
    if measured.complaints(leaves_plane):
        return  # one finding for one cause
    for run in _finished_runs(dropped):
        assert run.end is not None and dropped.start is not None
        moved_m = float(np.linalg.norm((run.end - dropped.start)[:2, 3]))
        if not run.at_rest and moved_m < measured.longest_m / 2:
            yield Complaint(
                f"in {run.engine} it still moves 4 s after it was put down, and rolls nowhere: it rocks, creeps or trembles",
                values={**_values(run), "moved_m": moved_m},
            )
            return


def depends_on_step(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a body that comes to rest differently at half the time step."""
    dropped = _drop_runs(measured)
    if measured.complaints(leaves_plane):
        return
    for one, other in combinations(_finished_runs(dropped), 2):
        if one.engine == other.engine:
            yield from _disagreements(measured, dropped, one, other, f"at half the step of {one.engine}")


def engines_disagree(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a body that comes to rest differently in another engine."""
    dropped = _drop_runs(measured)
    if measured.complaints(leaves_plane) or measured.complaints(depends_on_step):
        return  # one finding for one cause
    pairs = combinations(_default_step_runs(dropped), 2)
    found = (
        _disagreements(measured, dropped, one, other, f"in {other.engine} and in {one.engine}") for one, other in pairs
    )
    yield from islice(chain.from_iterable(found), 1)


def _disagreements(
    measured: MeasuredAsset, dropped: DropRuns, one: DropRun, other: DropRun, where: str
) -> Iterator[Complaint]:
    if not (one.at_rest and other.at_rest):
        return
    assert one.end is not None and other.end is not None
    up = [run.end[2, :3] for run in (one, other) if run.end is not None]  # the plane's normal in the asset's axes
    tilt_rad = float(np.arccos(np.clip(up[0] @ up[1], -1, 1)))
    apart_m = abs(dropped.height_m(one) - dropped.height_m(other))
    if tilt_rad > TURNED_RAD or apart_m > _slack_m(measured):
        yield Complaint(
            f"put down as it stands it comes to rest in another way {where}: {np.rad2deg(tilt_rad):.0f} degrees and"
            f" {1000 * apart_m:.3g} mm apart",
            values={"runs": [_values(one), _values(other)], "tilt_rad": tilt_rad, "apart_m": apart_m},
        )


def tips(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Note a body that tips over in every engine when put down in the pose of its file."""
    dropped = _drop_runs(measured)
    ended = _finished_runs(dropped)
    if not ended or dropped.start is None or measured.complaints(leaves_plane):
        return
    start = dropped.start
    up = [float(np.arccos(np.clip(run.end[2, :3] @ start[2, :3], -1, 1))) for run in ended if run.end is not None]
    if min(up) > TURNED_RAD:
        yield Complaint(
            f"put down as it stands it tips over, by {np.rad2deg(min(up)):.0f} degrees and more in"
            f" {', '.join(dict.fromkeys(run.engine for run in ended))}",
            values={"tilt_rad": up},
        )


def opening_closed(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a visible opening that a ball does not enter, or in which it does not stay."""
    asset = measured.asset
    if not measured.engines or asset.static or asset.partial or measured.complaints(filled_opening):
        return  # one finding for one cause
    if not has_convex_pieces(measured):
        return
    found = measured.measure_once(drop_balls)
    out = [engine for engine, inside in found.inside.items() if not inside]
    if out and found.opening is not None:
        radius_m = min(found.opening.rim_radius_m, found.opening.depth_m) / 3
        yield Complaint(
            f"a ball of {2000 * radius_m:.3g} mm that fits into the opening that is seen does not stay in it in {', '.join(out)}",
            values={"ball_radius_m": radius_m, "rim_radius_m": found.opening.rim_radius_m, "inside": found.inside},
        )


def joints_do_not_hold(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a twin that, with free joints in MuJoCo, leaves the plane or ends beyond a joint limit."""
    record = measured.record
    if "mujoco" not in measured.engines or record is None or not record.joints or not record.placements:
        return
    found = measured.measure_once(run_free_joints)
    if found.refused:
        yield Complaint(f"mujoco does not run it with its joints free: {found.refused}")
    elif found.beyond:
        yield Complaint(
            f"with its joints free it ends {'; '.join(found.beyond)}", values={"beyond": list(found.beyond)}
        )
    elif abs(found.lowest_m) > _slack_m(measured):
        where = "below" if found.lowest_m < 0 else "above"
        yield Complaint(
            f"with its joints free it ends {1000 * abs(found.lowest_m):.3g} mm {where} the plane that it was put on",
            values={"lowest_m": found.lowest_m},
        )


def _drop_runs(measured: MeasuredAsset) -> DropRuns:
    return measured.measure_once(run_drops) if measured.engines else DropRuns(None, None)


def _finished_runs(dropped: DropRuns) -> list[DropRun]:
    return [run for run in dropped.runs if run.end is not None]


def _default_step_runs(dropped: DropRuns) -> list[DropRun]:
    """Return the run of each engine at its usual time step."""
    return list({run.engine: run for run in reversed(_finished_runs(dropped))}.values())[::-1]


def _slack_m(measured: MeasuredAsset) -> float:
    return max(SUNK_M, SUNK_SHARE * measured.longest_m)


def _values(run: DropRun) -> dict[str, object]:
    return {"engine": run.engine, "timestep_s": run.timestep_s}


RULES = (
    Rule(
        "RUN001",
        "not-run",
        "note",
        why="What declares no mass, centre of mass, inertia or collision shape is run with what the engine invents: that says"
        " nothing of the asset.",
        remedy="Declare them; MAS, INE, COM and COL say which is missing.",
        check=not_run,
    ),
    Rule(
        "RUN002",
        "engine-refuses",
        "error",
        why="The engine does not take the body, or its pose stops being a number: inertia far from mass and size, needles and"
        " shards among the collision shapes.",
        remedy="Read what the engine says; INE and COL findings of the same asset usually name the cause.",
        check=refused,
    ),
    Rule(
        "RUN003",
        "leaves-plane",
        "error",
        why="A body that ends under the plane, or flies off it, is one that the solver cannot hold: an inertia far too small"
        " for its size and mass, or another unit for lengths than for mass.",
        remedy="See INE005 and SCL001 of the same asset.",
        check=leaves_plane,
    ),
    Rule(
        "RUN004",
        "does-not-rest",
        "note",
        why="A body that rocks, creeps or trembles on a table for long never settles: layouts wait for it, and what is put on"
        " it wanders. One that rolls away is not meant.",
        remedy="Round things rock. Overlapping or needle-like shapes, and inertia too small for the size, tremble: see INE005.",
        check=jitters,
    ),
    Rule(
        "RUN005",
        "rest-depends-on-step",
        "warning",
        why="At half the step the body comes to rest in another way: it is put down on an edge or a point, or its shapes"
        " meet the table in another order. A scene with it cannot be reproduced with another step.",
        remedy="Let it stand on a face; `manitwin build` finds stable poses.",
        check=depends_on_step,
    ),
    Rule(
        "RUN006",
        "engines-disagree",
        "warning",
        why="The same body, put down in the same way, comes to rest in another way in another engine: what is learned in one"
        " does not hold in the other.",
        remedy="Look at the collision shapes of the face that it stands on: pieces that are not level, points, round edges.",
        check=engines_disagree,
    ),
    Rule(
        "RUN007",
        "tips-over",
        "note",
        why="Put down as it stands in its file the object tips over. Many assets are drawn in another pose than they stand in:"
        " worth knowing before a scene is made of them.",
        remedy="Turn it, or use the poses that `manitwin build` finds.",
        check=tips,
    ),
    Rule(
        "RUN008",
        "opening-closed",
        "error",
        why="A bowl or a mug is there to put something in. Where what collides closes its mouth or fills its bottom, nothing"
        " goes in: the ball rests on an unseen lid (ManiSkill #867).",
        remedy="Decompose the walls into convex pieces that keep the mouth and the inside free; COL003 and COL004 tell where.",
        check=opening_closed,
    ),
    Rule(
        "RUN011",
        "joints-do-not-hold",
        "error",
        why="A twin with joints is verified with these locked. Set down with them free, links that are far too light, inertias"
        " that none of them has, or limits that they overlap beyond drive it through the table or its joints past their ends.",
        remedy="See the INE, MAS and JNT findings of the asset that it was imported from.",
        check=joints_do_not_hold,
    ),
)
