"""Load exported assets in four programs, and print how far each differs from the twin.

    python benchmarks/exports.py TWINS [--write docs/agreement.md] [--only NAME ...]

TWINS is a folder of accepted twins, or a data set. MJCF is loaded by MuJoCo, URDF by SAPIEN and PyBullet, SDF by PyBullet, and
USD by pxr. Compared are mass, centre of mass (relative to the longest side), principal moments and the size of the collision
shapes, in percent of the twin's own values. In the three engines the height of the centre of mass (relative to the longest side)
is compared too, after the object has rested in its first placement for two seconds. In MuJoCo and PyBullet a ball is dropped into
each container.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import pybullet
import sapien
import trimesh
from pxr import Usd, UsdGeom, UsdPhysics

from manitwin.assets.writers.exporter import TwinContent
from manitwin.assets.writers.write import export_twin
from manitwin.geometry.cavity import Opening, find_opening
from manitwin.geometry.poses import quaternion_wxyz, rotation_between, rotation_from_quaternion_wxyz, transform
from manitwin.physics.mujoco.body import STIFF_SOLREF
from manitwin.twin.loaded_twin import Twin

DROP_M, SECONDS, STEP_S = 0.001, 2.0, 1 / 500
BALL_SHARE, BALL_KG = 1 / 3, 0.01  # of the rim's radius or the depth, as in simulate.settle
PAGE_HEAD = """# One twin, the same everywhere

`python benchmarks/exports.py TWINS --write docs/agreement.md`: {count} twins are exported, and what four programs make of the
files is compared with the twin. Deviations in percent: mass, principal moments and size of the collision shapes of the twin's
own; centre of mass, and its height once the object was set down for two seconds, of the longest side.

PyBullet puts a skin of 1 mm around every hull that it loads (`gUrdfDefaultCollisionMargin`; no setting of a file or a call takes
it off): its sizes are 2 mm larger, and things rest 1 mm higher there. Its reader of SDF makes moments of inertia of the hulls,
whatever the file says.
"""
PROGRAMS = ("MJCF in MuJoCo", "URDF in SAPIEN", "URDF in PyBullet", "SDF in PyBullet", "USD in pxr")


@dataclass(frozen=True)
class Body:
    """The object as loaded by a program: ``points (N, 3)`` span its collision shapes; ``settle`` is None without physics.

    ``settle`` takes the object's pose on the plane and returns the pose after two seconds.
    """

    mass_kg: float
    center_of_mass_m: np.ndarray
    principal_moments: np.ndarray | None
    points: np.ndarray
    settle: Callable[[np.ndarray], np.ndarray] | None


@dataclass(frozen=True)
class Deviation:
    """Deviations of a program's object from the twin, in percent."""

    mass: float | None
    center_of_mass: float | None
    inertia: float | None
    size: float | None
    resting_height: float | None


def in_mujoco(path: Path) -> Body:
    """Load an MJCF file together with a ground plane."""
    spec = mujoco.MjSpec.from_file(str(path))
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[5, 5, 0.1])
    spec.option.timestep = 0.002
    model = spec.compile()
    body = 1
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    hulls = []
    for geom in np.flatnonzero(model.geom_bodyid == body):
        if model.geom_contype[geom]:
            mesh = model.geom_dataid[geom]
            first = model.mesh_vertadr[mesh]
            local = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
            hulls.append(local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])

    def settle(pose: np.ndarray) -> np.ndarray:
        state = mujoco.MjData(model)
        state.qpos[:3], state.qpos[3:7] = pose[:3, 3], quaternion_wxyz(pose[:3, :3])
        mujoco.mj_step(model, state, round(SECONDS / model.opt.timestep))
        return transform(state.xmat[body].reshape(3, 3), state.xpos[body])

    return Body(
        float(model.body_mass[body]), model.body_ipos[body].copy(), model.body_inertia[body].copy(), np.concatenate(hulls),
        settle,
    )  # fmt: skip


def in_sapien(path: Path) -> Body:
    """Load a URDF file with SAPIEN's own loader."""
    scene = sapien.Scene()
    scene.set_timestep(STEP_S)
    scene.add_ground(0.0)
    loader = scene.create_urdf_loader()
    _, (entity,) = loader.load_multiple(str(path))[:2]  # SAPIEN loads one link as an actor, not as an articulation
    link = entity.find_component_by_type(sapien.physx.PhysxRigidDynamicComponent)
    points = []
    for shape in link.get_collision_shapes():
        local = np.asarray(shape.vertices) * np.asarray(shape.scale)
        pose = shape.get_local_pose()
        points.append(local @ rotation_from_quaternion_wxyz(np.array(pose.q)).T + pose.p)

    def settle(pose: np.ndarray) -> np.ndarray:
        entity.set_pose(sapien.Pose(pose[:3, 3], quaternion_wxyz(pose[:3, :3])))
        for _ in range(round(SECONDS / STEP_S)):
            scene.step()
        end = entity.get_pose()
        return transform(rotation_from_quaternion_wxyz(np.array(end.q)), np.array(end.p))

    center = link.get_cmass_local_pose()
    return Body(
        float(link.get_mass()), np.array(center.p), np.array(link.get_inertia()), np.concatenate(points), settle
    )


def in_pybullet(path: Path) -> Body:
    """Load a URDF or SDF file in PyBullet together with a ground plane."""
    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0, 0, -9.81, client)
    plane = pybullet.createMultiBody(
        0, pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client), physicsClientId=client
    )
    if path.suffix == ".sdf":
        (body,) = pybullet.loadSDF(str(path), physicsClientId=client)
    else:
        body = pybullet.loadURDF(str(path), flags=pybullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client)
    info = pybullet.getDynamicsInfo(body, -1, client)
    inertial = transform(np.array(pybullet.getMatrixFromQuaternion(info[4])).reshape(3, 3), info[3])
    points = _extremes_in_pybullet(client, body, inertial)

    def settle(pose: np.ndarray) -> np.ndarray:
        center = pose @ inertial
        quaternion = quaternion_wxyz(center[:3, :3])
        pybullet.resetBasePositionAndOrientation(body, center[:3, 3], np.roll(quaternion, -1), client)
        pybullet.setTimeStep(STEP_S, client)
        for _ in range(round(SECONDS / STEP_S)):
            pybullet.stepSimulation(client)
        position, xyzw = pybullet.getBasePositionAndOrientation(body, client)
        return transform(np.array(pybullet.getMatrixFromQuaternion(xyzw)).reshape(3, 3), position) @ np.linalg.inv(
            inertial
        )

    assert plane != body
    moments = None if path.suffix == ".sdf" else np.array(info[2])  # PyBullet computes those of SDF from hulls
    return Body(float(info[0]), np.array(info[3]), moments, points, settle)


def _extremes_in_pybullet(client: int, body: int, inertial: np.ndarray) -> np.ndarray:
    """Return the lowest and highest corner ``(2, 3)`` by distances to six walls, as PyBullet shows no hulls."""
    quaternion = quaternion_wxyz(inertial[:3, :3])
    pybullet.resetBasePositionAndOrientation(body, inertial[:3, 3], np.roll(quaternion, -1), client)
    corners = np.zeros((2, 3))
    for axis in range(3):
        for side, sign in enumerate((-1.0, 1.0)):
            half = np.full(3, 2.0)
            half[axis] = 0.1
            shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=client)
            place = np.zeros(3)
            place[axis] = sign * 1.1
            wall = pybullet.createMultiBody(0, shape, basePosition=place, physicsClientId=client)
            nearest = min(point[8] for point in pybullet.getClosestPoints(body, wall, 3.0, physicsClientId=client))
            corners[side, axis] = sign * (1.0 - nearest)
            pybullet.removeBody(wall, client)
    return corners


def in_usd(path: Path) -> Body:
    """Open a USD stage and read its physics schemas."""
    stage = Usd.Stage.Open(str(path))
    root = stage.GetDefaultPrim()
    mass = UsdPhysics.MassAPI(root)
    points = []
    for prim in Usd.PrimRange(root):
        if prim.HasAPI(UsdPhysics.CollisionAPI):
            to_world = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default())).T
            points.append(trimesh.transform_points(np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get()), to_world))
    unit = UsdGeom.GetStageMetersPerUnit(stage)
    return Body(
        float(mass.GetMassAttr().Get()), unit * np.array(mass.GetCenterOfMassAttr().Get()),
        unit**2 * np.array(mass.GetDiagonalInertiaAttr().Get()), unit * np.concatenate(points), None,
    )  # fmt: skip


LOADERS = {
    "MJCF in MuJoCo": ("mjcf", in_mujoco),
    "URDF in SAPIEN": ("urdf", in_sapien),
    "URDF in PyBullet": ("urdf", in_pybullet),
    "SDF in PyBullet": ("sdf", in_pybullet),
    "USD in pxr": ("usd", in_usd),
}


def deviation(twin: TwinContent, body: Body) -> Deviation:
    """Return the deviations of a program's body from the twin."""
    physical, longest = twin.physical, max(twin.physical.extents_m)
    center, moments = np.array(physical.center_of_mass_m), np.linalg.eigvalsh(np.array(physical.inertia_kg_m2))
    hulls = np.concatenate([vertices for vertices, _ in twin.hulls])
    size = np.ptp(hulls, axis=0)
    height = None
    if body.settle is not None and twin.record.placements:
        first = twin.record.placements[0]
        pose = transform(rotation_from_quaternion_wxyz(np.array(first.quaternion_wxyz)), np.array(first.position_m))
        expected = (pose @ [*center, 1])[2]
        pose[2, 3] += DROP_M
        height = 100 * abs((body.settle(pose) @ [*center, 1])[2] - expected) / longest
    return Deviation(
        100 * abs(body.mass_kg / physical.mass_kg.value - 1),
        100 * float(np.linalg.norm(body.center_of_mass_m - center)) / longest,
        None
        if body.principal_moments is None
        else 100 * float(np.abs(np.sort(body.principal_moments) / moments - 1).max()),
        100 * float(np.abs(np.ptp(body.points, axis=0) / size - 1).max()),
        height,
    )


def ball_in_mujoco(path: Path, opening: Opening) -> bool:
    """Drop a ball into the fixed container of an MJCF file, and tell whether it stays inside."""
    spec = mujoco.MjSpec.from_file(str(path))
    (vessel,) = spec.worldbody.bodies
    for joint in list(vessel.joints):
        spec.delete(joint)
    turn = rotation_between(opening.axis, np.array([0.0, 0, 1]))
    vessel.quat = quaternion_wxyz(turn)
    for geom in vessel.geoms:
        geom.solref = STIFF_SOLREF  # with MuJoCo's default contacts a falling ball penetrates a floor by a centimetre
    radius, start = _ball(opening, turn)
    ball = spec.worldbody.add_body(name="ball", pos=start)
    ball.add_freejoint()
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0, 0], mass=BALL_KG, solref=STIFF_SOLREF)
    spec.option.timestep = 0.001
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, round(SECONDS / model.opt.timestep))
    return _inside(data.body("ball").xpos, opening, turn)


def ball_in_pybullet(path: Path, opening: Opening) -> bool:
    """Drop a ball into the fixed container of a URDF file, and tell whether it stays inside."""
    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0, 0, -9.81, client)
    turn = rotation_between(opening.axis, np.array([0.0, 0, 1]))
    radius, start = _ball(opening, turn)
    pybullet.loadURDF(
        str(path), basePosition=(0, 0, 0), baseOrientation=np.roll(quaternion_wxyz(turn), -1), useFixedBase=True,
        physicsClientId=client,
    )  # fmt: skip
    shape = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=radius, physicsClientId=client)
    ball = pybullet.createMultiBody(BALL_KG, shape, basePosition=start, physicsClientId=client)
    pybullet.setTimeStep(0.001, client)
    for _ in range(round(SECONDS / 0.001)):
        pybullet.stepSimulation(client)
    inside = _inside(np.array(pybullet.getBasePositionAndOrientation(ball, client)[0]), opening, turn)
    pybullet.disconnect(client)
    return inside


def _ball(opening: Opening, turn: np.ndarray) -> tuple[float, np.ndarray]:
    radius = BALL_SHARE * min(opening.rim_radius_m, opening.depth_m)
    return radius, turn @ opening.center_m + [0, 0, 2 * radius + 0.005]


def _inside(ball: np.ndarray, opening: Opening, turn: np.ndarray) -> bool:
    away = ball - turn @ opening.center_m
    return bool(-opening.depth_m <= away[2] < 0 and np.linalg.norm(away[:2]) < 1.5 * opening.rim_radius_m)


def _row(name: str, found: Deviation) -> str:
    values = (found.mass, found.center_of_mass, found.inertia, found.size, found.resting_height)
    return f"| {name} | {' | '.join('-' if value is None else f'{value:.2f}' for value in values)} |"


def _largest(found: list[Deviation], part: str) -> float | None:
    values = [value for each in found if (value := getattr(each, part)) is not None]
    return max(values) if values else None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("twins", type=Path)
    parser.add_argument("--write", type=Path, help="a page of documentation to write the table into")
    parser.add_argument("--only", nargs="*", default=None, help="names of objects")
    arguments = parser.parse_args()
    worst: dict[str, list[Deviation]] = {program: [] for program in PROGRAMS}
    rows, balls = [], []
    for record in sorted(arguments.twins.rglob("twin.json")):
        if ".work" in record.parts:
            continue
        twin = Twin(record.parent)
        if twin.record.status != "accepted" or (arguments.only and twin.record.name not in arguments.only):
            continue
        content = TwinContent.of(twin)
        name = f"{twin.record.name or 'object'} {twin.record.twin_id[:4]}"
        with tempfile.TemporaryDirectory() as folder:
            files = {kind: export_twin(content, kind, folder) for kind in ("mjcf", "urdf", "sdf", "usd")}
            for program, (kind, load) in LOADERS.items():
                found = deviation(content, load(files[kind]))
                worst[program].append(found)
                rows.append(_row(f"{name} | {program}", found))
                print(rows[-1], flush=True)
            if twin.record.mesh is not None and twin.record.mesh.hulls.keeps_opening:
                whole = trimesh.util.concatenate(
                    [trimesh.Trimesh(part.vertices, part.faces) for part in content.visual]
                )
                opening = find_opening(whole)
                if opening is not None:
                    balls.append(
                        (name, ball_in_mujoco(files["mjcf"], opening), ball_in_pybullet(files["urdf"], opening))
                    )
                    print(f"ball in {name}: MuJoCo {balls[-1][1]}, PyBullet {balls[-1][2]}", flush=True)
    page = _page(worst, rows, balls)
    print(page)
    if arguments.write:
        arguments.write.write_text(page)


def _page(worst: dict[str, list[Deviation]], rows: list[str], balls: list[tuple[str, bool, bool]]) -> str:
    head = ["mass", "centre of mass", "principal moments", "size", "resting height"]
    count = len(next(iter(worst.values())))
    lines = [
        *PAGE_HEAD.format(count=count).splitlines(),
        "",
        "## The largest of all objects",
        "",
        f"| | {' | '.join(head)} |",
        f"|---|{'---|' * len(head)}",
    ]
    for program, found in worst.items():
        parts = ("mass", "center_of_mass", "inertia", "size", "resting_height")
        lines.append(_row(program, Deviation(*(_largest(found, part) for part in parts))))
    stays = sum(in_one and in_other for _, in_one, in_other in balls)
    lines += [
        "",
        "## Hollow things stay open",
        "",
        f"A ball dropped into {len(balls)} vessels stays inside in MuJoCo and in PyBullet: {stays} of {len(balls)}.",
    ]
    lines += [
        f"- {name}: MuJoCo {'in' if one else 'OUT'}, PyBullet {'in' if other else 'OUT'}"
        for name, one, other in balls
        if not (one and other)
    ]
    lines += [
        "",
        "## Every object",
        "",
        f"| object | program | {' | '.join(head)} |",
        f"|---|---|{'---|' * len(head)}",
        *rows,
        "",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
