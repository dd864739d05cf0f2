"""README notes on each export format: where it stores each quantity, its frame, and how to load its files."""

from __future__ import annotations

from dataclasses import dataclass, field

QUANTITIES = ("mass", "centre of mass", "inertia", "friction", "restitution", "hulls", "frame")
NOWHERE = "not said"
UNTOLD = "the format's package does not tell"
Z_UP = "the object frame: +Z up, origin at the bottom centre, metres"
Y_UP = "glTF's: +Y up; (x, y, z) of the object frame is (x, z, -y)"


@dataclass(frozen=True)
class FormatNotes:
    """Notes on a format: ``says`` maps ``QUANTITIES`` to their place in the files, ``load`` maps simulators to short code.

    In the code, ``{main}`` stands for the file to open, ``{folder}`` for the name of its folder, and ``{name}`` and ``{NAME}``
    for the name of the twin.
    """

    title: str
    frame: str
    says: dict[str, str] = field(default_factory=dict)
    load: dict[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, format_name: str) -> FormatNotes:
        """Return the notes of a built-in format, or placeholder notes for the format of another package."""
        return NOTES.get(format_name) or cls(format_name, UNTOLD, dict.fromkeys(QUANTITIES, UNTOLD))

    def where(self, quantity: str) -> str:
        """Return where the files hold a quantity."""
        return self.frame if quantity == "frame" else self.says.get(quantity, NOWHERE)


_LOAD_USD = {
    "Isaac Sim": (
        "from isaacsim.core.utils.stage import add_reference_to_stage\n\n"
        'add_reference_to_stage(usd_path="{main}", prim_path="/World/{name}")'
    ),
    "OpenUSD": (
        "from pxr import Usd\n\n"
        'stage = Usd.Stage.Open("{main}")\n'
        'print(stage.GetDefaultPrim().GetAttribute("physics:mass").Get())'
    ),
}
_USD_SAYS = {
    "mass": "`physics:mass`",
    "centre of mass": "`physics:centerOfMass`",
    "inertia": "`physics:diagonalInertia` along `physics:principalAxes`",
    "friction": "`physics:staticFriction`, `physics:dynamicFriction` of the bound physics material",
    "restitution": "`physics:restitution` of the bound physics material",
    "hulls": "a mesh each, `physics:approximation = convexHull`",
}
_PHYSICS_JSON = {
    "friction": "`friction_static`, `friction_dynamic` in physics.json",
    "restitution": "`restitution` in physics.json",
}

NOTES: dict[str, FormatNotes] = {
    "mjcf": FormatNotes(
        "MJCF",
        Z_UP,
        says={
            "mass": "`<inertial mass>`",
            "centre of mass": "`<inertial pos>`",
            "inertia": "`<inertial fullinertia>`, about the centre of mass",
            "friction": "`<geom friction>` of each hull: slide (the static one), torsional, rolling; both in physics.json",
            "restitution": _PHYSICS_JSON["restitution"],
            "hulls": "a mesh geom each, group 3; the visual meshes are in group 2 and touch nothing",
        },
        load={
            "MuJoCo": 'import mujoco\n\nmodel = mujoco.MjModel.from_xml_path("{main}")',
            "MuJoCo, into a scene": (
                "import mujoco\n\n"
                'scene, twin = mujoco.MjSpec(), mujoco.MjSpec.from_file("{main}")\n'
                'scene.attach(twin, frame=scene.worldbody.add_frame(pos=[0, 0, 0.1]), prefix="a_")\n'
                "model = scene.compile()"
            ),
        },
    ),
    "urdf": FormatNotes(
        "URDF",
        Z_UP,
        says={
            "mass": "`<mass>`",
            "centre of mass": "`<inertial><origin>`",
            "inertia": "`<inertia>`, the full tensor about the centre of mass along the link's axes",
            "friction": f"`<contact><lateral_friction>` (PyBullet only, the static coefficient); {_PHYSICS_JSON['friction']}",
            "restitution": f"`<contact><restitution>` (PyBullet only); {_PHYSICS_JSON['restitution']}",
            "hulls": "a `<collision>` each",
        },
        load={
            "PyBullet, which makes its own inertia without the flag": (
                "import pybullet\n\n"
                "pybullet.connect(pybullet.DIRECT)\n"
                'body = pybullet.loadURDF("{main}", flags=pybullet.URDF_USE_INERTIA_FROM_FILE)'
            ),
            "SAPIEN, which takes friction from you": (
                "import json, pathlib, sapien\n\n"
                'physics = json.loads(pathlib.Path("physics.json").read_text())\n'
                'contact = [physics[key]["value"] for key in ("friction_static", "friction_dynamic", "restitution")]\n'
                "loader = sapien.Scene().create_urdf_loader()\n"
                "loader.set_material(*contact)\n"
                '_, [body] = loader.load_multiple("{main}")'
            ),
        },
    ),
    "sdf": FormatNotes(
        "SDFormat 1.9",
        Z_UP,
        says={
            "mass": "`<mass>`",
            "centre of mass": "`<inertial><pose>`",
            "inertia": "`<inertia>`, the full tensor about the centre of mass along the link's axes",
            "friction": f"`<surface><friction>` of each hull: the static coefficient; {_PHYSICS_JSON['friction']}",
            "restitution": "`<surface><bounce>` of each hull",
            "hulls": "a `<collision>` each",
        },
        load={
            "Gazebo, in this folder": (
                "export GZ_SIM_RESOURCE_PATH=$PWD\n"
                "# and in a world: <include><uri>model://{name}</uri><pose>0 0 0 0 0 0</pose></include>"
            ),
            "PyBullet, which makes its own inertia and friction from SDF": (
                "import pybullet\n\n"
                "pybullet.connect(pybullet.DIRECT)\n"
                'bodies = pybullet.loadSDF("{main}")'
            ),
        },
    ),
    "glb": FormatNotes(
        "GLB",
        Y_UP,
        says={
            "mass": "`asset.extras.manitwin_physics.mass_kg` of collision.glb",
            "centre of mass": "`center_of_mass_m` there, in the object frame (+Z up)",
            "inertia": "`inertia_kg_m2` there, about the centre of mass, in the object frame",
            "friction": "`friction_static`, `friction_dynamic` there",
            "restitution": "`restitution` there",
            "hulls": "a mesh each in collision.glb",
        },
        load={
            "trimesh": 'import trimesh\n\nvisual = trimesh.load_scene("visual.glb")\nhulls = trimesh.load_scene("collision.glb")',
        },
    ),
    "usd": FormatNotes("USD", Z_UP, says=_USD_SAYS, load=_LOAD_USD),
    "usdz": FormatNotes("USDZ", Z_UP, says=_USD_SAYS, load=_LOAD_USD),
    "isaaclab": FormatNotes(
        "Isaac Lab",
        Z_UP,
        says={key: f"{where} of the stage" for key, where in _USD_SAYS.items()},
        load={
            "Isaac Lab, in a scene's configuration": (
                'from {name}_cfg import {NAME}_CFG\n\nthing = {NAME}_CFG.replace(prim_path="{ENV_REGEX_NS}/{name}")'
            )
        },
    ),
    "maniskill": FormatNotes(
        "ManiSkill 3",
        Z_UP,
        says={
            "mass": "`mass_kg` in info_raw.json, and `density`, which gives the same with the hulls",
            "centre of mass": "`center_of_mass_m` in info_raw.json",
            "inertia": "`principal_moments_kg_m2` along `principal_axes_quaternion_wxyz` in info_raw.json",
            "friction": "`friction_static`, `friction_dynamic` in info_raw.json",
            "restitution": "`restitution` in info_raw.json",
            "hulls": "parts of collision.ply that are not connected",
        },
        load={
            "ManiSkill or SAPIEN": (
                "from load import object_builder, object_names\n\n"
                'actor = object_builder(scene, object_names()[0]).build(name="{name}")'
            )
        },
    ),
    "robotwin": FormatNotes(
        "RoboTwin 2.0",
        Y_UP,
        says={
            "mass": "object_mass.json; `mass_kg` in physics0.json",
            "centre of mass": "`center_of_mass_m` in physics0.json, in the object frame (+Z up)",
            "inertia": "`inertia_kg_m2` in physics0.json, in the object frame",
            "friction": "`friction_static`, `friction_dynamic` in physics0.json",
            "restitution": "`restitution` in physics0.json",
            "hulls": "a mesh each in collision/base0.glb",
        },
        load={
            "RoboTwin, after copying `assets` and `description` into its folder": (
                "import sapien\nfrom envs.utils import create_actor\n\n"
                "pose = sapien.Pose([0, 0, 0.741], [0.7071068, 0.7071068, 0, 0])  # on the table, upright\n"
                'actor = create_actor(scene, pose, modelname="{folder}", convex=True, model_id=0)'
            )
        },
    ),
    "graspgen": FormatNotes(
        "GraspGen",
        f"{Z_UP}; `transforms` are poses of the gripper's base link in it",
        load={
            "Python": (
                "import json, pathlib\n\n"
                'grasps = json.loads(pathlib.Path("{main}").read_text())["grasps"]\n'
                'held = [t for t, ok in zip(grasps["transforms"], grasps["object_in_gripper"]) if ok]'
            )
        },
    ),
    "isaac_grasp": FormatNotes(
        "isaac_grasp",
        f"{Z_UP}; `position` and `orientation` are the pose of the gripper's link in it",
        load={
            "Isaac Sim": (
                "from isaacsim.robot_setup.grasp_editor import import_grasps_from_file\n\n"
                'grasps = import_grasps_from_file("{main}").get_grasp_dicts()'
            )
        },
    ),
}  # fmt: skip
