"""Compare masses, centres and inertias read from MJCF and URDF files with those of MuJoCo's own compiler.

python benchmarks/mujoco_agreement.py FOLDER...                  every MJCF and URDF asset below the folders
python benchmarks/mujoco_agreement.py FOLDER... --most 40        that many of each folder, drawn with --seed

MuJoCo loads the file itself, in a separate process. The bodies that the reader merged into one are summed in world axes and
compared with the values read, as far as the file declares them. Prints each asset that differs, and the counts.
"""

from __future__ import annotations

import argparse
import os
import random
from collections import Counter
from pathlib import Path

import mujoco
import numpy as np

from manitwin.assets.asset import Asset
from manitwin.assets.read import file_format, find_assets, read_asset
from manitwin.assets.readers.urdf import open_urdf
from manitwin.errors import AssetError
from manitwin.formats.isolated import Limits, ProcessCrashed, run_isolated

FORMATS = ("mjcf", "urdf")
LIMITS = Limits(120.0, 8 << 30)
NEAR = 1e-3
"""Tolerance relative to the mass and to the largest moment; for centres relative to the longest side."""


def compared(path: Path, root: Path) -> tuple[str, str]:
    """Return the result for one asset (agrees, differs, or why it cannot be compared) and the numbers that differ."""
    try:
        asset = read_asset(path, root=root)
    except AssetError as error:
        return "not read", " ".join(str(error).split())
    if asset.inertial.mass_kg is None:
        return "declares no mass", ""
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        spec.compiler.fusestatic = False
        spec.compiler.discardvisual = False
        model = spec.compile()
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        return "MuJoCo does not compile it", " ".join(str(error).split())
    head = head_of(asset, model, root)
    if head is None:
        return "MuJoCo has no body with a shape", ""
    apart = differences(asset, *summed(model, head))
    return ("differs", apart) if apart else ("agrees", "")


def head_of(asset: Asset, model: mujoco.MjModel, root: Path) -> int | None:
    """Return the first body of the rigid group that the reader takes.

    It is found by its name, else it is the first free group (MJCF) with a shape, else the first group with a shape.
    """
    name = asset.name if asset.format == "mjcf" else str(open_urdf(asset.path, root).links[0][0].get("name"))
    named = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    if named > 0 and (
        model.body_parentid[named] == 0 or model.body_jntnum[named]
    ):  # otherwise a file's name is that of a part too
        return int(named)
    heads = [b for b in range(1, model.nbody) if model.body_parentid[b] == 0 or model.body_jntnum[b]]
    shaped = [head for head in heads if any(_is_solid(model, body) for body in group_of(model, head))]
    free = [head for head in shaped if asset.format == "mjcf" and _is_free(model, head)]
    return (free or shaped or [None])[0]


def group_of(model: mujoco.MjModel, head: int) -> list[int]:
    """Return a body and all bodies welded to it."""
    group = [head]
    for body in range(head + 1, model.nbody):
        if model.body_parentid[body] in group and not model.body_jntnum[body]:
            group.append(body)
    return group


def _is_solid(model: mujoco.MjModel, body: int) -> bool:
    first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    geoms = [
        geom for geom in range(first, first + count) if model.geom_type[geom] not in (0, 1)
    ]  # planes and height fields
    return any(model.geom_group[g] < 3 or model.geom_contype[g] or model.geom_conaffinity[g] for g in geoms)


def _is_free(model: mujoco.MjModel, body: int) -> bool:
    return bool(model.body_jntnum[body]) and model.jnt_type[model.body_jntadr[body]] == mujoco.mjtJoint.mjJNT_FREE


def summed(model: mujoco.MjModel, head: int) -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass, centre, and inertia about the centre of a body and all bodies welded to it, in the head's axes."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    group = group_of(model, head)
    masses = model.body_mass[group]
    mass_kg = float(masses.sum())
    center = masses @ data.xipos[group] / max(mass_kg, 1e-300)
    inertia = np.zeros((3, 3))
    for body in group:
        axes, offset = data.ximat[body].reshape(3, 3), data.xipos[body] - center
        inertia += axes @ np.diag(model.body_inertia[body]) @ axes.T
        inertia += model.body_mass[body] * ((offset @ offset) * np.eye(3) - np.outer(offset, offset))
    turn = data.xmat[head].reshape(3, 3)
    return mass_kg, turn.T @ (center - data.xpos[head]), turn.T @ inertia @ turn


def differences(asset: Asset, mass_kg: float, center_m: np.ndarray, inertia_kg_m2: np.ndarray) -> str:
    """Describe in which declared mass properties an asset differs from the given ones; empty if in none."""
    said, apart = asset.inertial, []
    if said.mass_kg is None or abs(said.mass_kg - mass_kg) > NEAR * mass_kg:
        apart.append(f"mass {said.mass_kg!r} and {mass_kg:.6g} kg")
    longest_m = max((float(np.ptp(np.asarray(part.vertices), axis=0).max()) for part in asset.visual), default=1.0)
    if (
        mass_kg > 0
        and said.center_of_mass_m is not None
        and np.abs(said.center_of_mass_m - center_m).max() > NEAR * longest_m
    ):
        apart.append(f"centre {np.round(said.center_of_mass_m, 6).tolist()} and {np.round(center_m, 6).tolist()} m")
    largest = float(np.abs(inertia_kg_m2).max())
    if said.inertia_kg_m2 is not None and np.abs(said.inertia_kg_m2 - inertia_kg_m2).max() > NEAR * largest:
        moments = (np.linalg.eigvalsh(each) for each in (said.inertia_kg_m2, inertia_kg_m2))
        apart.append(f"moments {' and '.join(str([float(f'{m:.4g}') for m in each]) for each in moments)} kg m2")
    return ", ".join(apart)


def main() -> None:
    """Compare the assets below the folders and print the differences."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--most", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--verbose", action="store_true", help="also why an asset is not compared")
    arguments = parser.parse_args()
    os.environ["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    total: Counter[str] = Counter()
    for folder in arguments.folders:
        paths = [path for path in find_assets(folder) if path.is_file() and file_format(path) in FORMATS]
        if arguments.most is not None and len(paths) > arguments.most:
            paths = sorted(random.Random(arguments.seed).sample(paths, arguments.most))
        counts: Counter[str] = Counter()
        for path in paths:
            try:
                outcome, said = run_isolated("mujoco_agreement:compared", path, folder, limits=LIMITS)
            except (ProcessCrashed, MemoryError) as error:
                outcome, said = "process ended", type(error).__name__
            counts[outcome] += 1
            if outcome == "differs" or (arguments.verbose and said):
                print(f"  {path.relative_to(folder)}: {outcome}: {said[:300]}", flush=True)
        print(f"{folder.name}: {dict(counts)}", flush=True)
        total += counts
    print(f"all: {dict(total)}")


if __name__ == "__main__":
    main()
