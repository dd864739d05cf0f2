"""Transfer verified grasps to estimated poses of objects, and try them at the true pose.

    python benchmarks/locate_grasps.py DATASET SCENES... [--most N] [--grasps N] [--seed N] [-o FILE]

Scenes are rendered as for ``benchmarks/locate.py``, with the same noise, masks and boards. For each located object, the first
``--grasps`` of its transferred grasps are tried in PhysX with the trial of a build. Only grasps free of the table and of visible
neighbours are used, those most likely to hold first. The hand is at the estimated pose and the object at its true pose, so that
the error of the estimate is the error of the grasp. The trial contains only this object. In a crowded view few grasps are free.
Therefore as many verified ones, drawn at random without regard to obstacles, are tried too (``drawn``) where the pose is not
ambiguous.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from locate import BANDS, RIGHT, Models, errors, questions

from manitwin.config import VerifyConfig
from manitwin.errors import UsageError
from manitwin.geometry.poses import inverse
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.pipeline.verify import trial_settings
from manitwin.robots.grippers.gripper import Gripper, load_gripper
from manitwin.scenes.locate.depth_view import measured_noise_m
from manitwin.scenes.locate.estimate import locate_in_view
from manitwin.scenes.locate.proposals import table_plane
from manitwin.scenes.locate.recognition import ViewedObject
from manitwin.scenes.locate.transferred_grasps import transfer_grasps
from manitwin.twin.loaded_twin import Twin, TwinSource
from manitwin.twin.proportions import wilson_interval


def rows_of(
    dataset: Path, scenes: Path, most: int, count: int, seed: int, kept: Callable[[list[dict[str, Any]]], object]
) -> list[dict[str, Any]]:
    """Locate the objects of rendered scenes and try their transferred grasps; ``kept`` receives the rows so far."""
    models, source, rng = Models(dataset), TwinSource(dataset), np.random.default_rng(seed)
    rows: list[dict[str, Any]] = []
    for twin_id, share, view, mask, true in questions(scenes, rng):
        kept(rows)
        if len(rows) == most:
            break
        twin, location = source.twin(twin_id), locate_in_view(view, mask, models.of(twin_id))
        row: dict[str, Any] = {
            "twin": twin_id,
            "share": share,
            "status": location.status,
            "right": False,
            "free": [],
            "drawn": [],
        }
        rows.append(row)
        if not location.poses:
            continue
        gripper, verified = load_gripper(twin.record.grasps.gripper), twin.grasps().gripper_to_object  # type: ignore[union-attr]
        model, found = models.of(twin_id), location.poses[0].object_to_camera
        add, adds = errors(model, found, true)
        row["right"] = bool((adds if len(model.symmetry_poses) > 1 else add) < RIGHT)
        true_to_found = inverse(true) @ found
        if location.status == "found":
            some = rng.choice(len(verified), min(count, len(verified)), replace=False)
            row["drawn"] = outcomes_of(twin, gripper, true_to_found @ verified[some])
        try:
            plane = table_plane(view, np.random.default_rng(seed))
        except UsageError:
            row["status"] = "no_table"
            continue
        noise_m = measured_noise_m(view, np.ones(view.depth_m.shape, bool))
        thing = ViewedObject(mask, location, models.of(twin_id), ())
        carried = transfer_grasps(thing, twin, view, plane, noise_m)
        if carried is None or not carried.grasps:
            continue
        free = np.array([inverse(true) @ grasp.gripper_to_camera for grasp in carried.grasps[:count]])
        row["free"] = outcomes_of(twin, gripper, free)
    return rows


def outcomes_of(twin: Twin, gripper: Gripper, gripper_to_object: np.ndarray) -> list[str]:
    """Return the outcome of each grasp in the trial of a build."""
    settings = trial_settings(VerifyConfig(), gripper)
    return [each.outcome for each in SapienTrial().run(twin.rigid_body(), gripper, gripper_to_object, settings)]


def told(name: str, rows: list[dict[str, Any]], which: str) -> None:
    """Print how many of the grasps hold, and for how many objects the first one does."""
    rows = [{**row, "outcomes": row[which]} for row in rows]
    outcomes = [outcome for row in rows for outcome in row["outcomes"]]
    held = outcomes.count("held")
    with_grasp = [row for row in rows if row["outcomes"]]
    first = sum(row["outcomes"][0] == "held" for row in with_grasp)
    if not outcomes:
        print(f"{name}: no grasp was carried to any of {len(rows)} things")
        return
    spans = [wilson_interval(held, len(outcomes)), wilson_interval(first, len(with_grasp))]
    said = [f"{100 * low:.0f} to {100 * high:.0f} %" for low, high in spans]
    print(
        f"{name}: {len(rows)} things, {len(with_grasp)} with such a grasp; {held} of {len(outcomes)} grasps hold"
        f" = {held / len(outcomes):.1%} ({said[0]}); the first of each {first} of {len(with_grasp)} ({said[1]})"
    )
    print(f"  {dict(Counter(outcomes).most_common())}; found: {dict(Counter(row['status'] for row in rows))}")


def main() -> None:
    """Try transferred grasps of objects in rendered scenes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("scenes", type=Path, nargs="+")
    parser.add_argument("--most", type=int, default=120)
    parser.add_argument("--grasps", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--out", type=Path)
    given = parser.parse_args()
    kept: dict[str, list[dict[str, Any]]] = {}

    def keep(name: str, rows: list[dict[str, Any]]) -> None:
        kept[name] = rows
        if given.out:
            given.out.write_text(json.dumps(kept, indent=1, default=float))

    for scenes in given.scenes:
        rows = rows_of(given.dataset, scenes, given.most, given.grasps, given.seed, partial(keep, scenes.name))
        for low, high in BANDS:
            some = [row for row in rows if low <= row["share"] < high]
            right = sum(row["right"] for row in some)
            print(f"{scenes.name}, visible {low} to {min(high, 1)}: {right} of {len(some)} poses right")
        for which in ("free", "drawn"):
            told(f"{scenes.name}, {which}", rows, which)
            for low, high in BANDS:
                some = [row for row in rows if low <= row["share"] < high]
                told(f"{scenes.name}, {which}, visible {low} to {min(high, 1)}", some, which)


if __name__ == "__main__":
    main()
