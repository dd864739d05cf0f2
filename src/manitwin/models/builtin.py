"""Table of the backends that come with the package, by kind and name.

A backend that needs a key, a server or an external program raises an error that says so when it is created.
"""

BACKENDS: dict[str, dict[str, str]] = {
    "generator": {
        "lift": "manitwin.models.generators.lift:LiftGenerator",
        "rodin": "manitwin.models.generators.rodin:RodinGenerator",
        "tripo": "manitwin.models.generators.tripo:TripoGenerator",
        "meshy": "manitwin.models.generators.meshy:MeshyGenerator",
        "hunyuan3d": "manitwin.models.generators.hunyuan3d:Hunyuan3dGenerator",
        "fal": "manitwin.models.generators.fal:FalGenerator",
        "command": "manitwin.models.generators.command:CommandGenerator",
    },
    "annotator": {
        "rules": "manitwin.models.annotators.rules:RulesAnnotator",
        "openai": "manitwin.models.annotators.vlm.annotator:OpenAiAnnotator",
        "anthropic": "manitwin.models.annotators.vlm.annotator:AnthropicAnnotator",
        "replay": "manitwin.models.annotators.vlm.annotator:ReplayAnnotator",
    },
    "grasper": {
        "antipodal": "manitwin.models.graspers.surface_sampling:AntipodalGrasper",
        "suction": "manitwin.models.graspers.surface_sampling:SuctionGrasper",
        "postures": "manitwin.models.graspers.postures:PostureGrasper",
        "graspgen": "manitwin.models.graspers.graspgen:GraspGenGrasper",
        "graspgenx": "manitwin.models.graspers.graspgenx:GraspGenXGrasper",
    },
    "simulator": {
        "sapien": "manitwin.physics.sapien.trial:SapienTrial",
        "mujoco": "manitwin.physics.mujoco.trial:MujocoTrial",
        "statics": "manitwin.physics.suction_trial:SuctionTrial",
        "sapien_articulation": "manitwin.physics.sapien.fingers:ArticulatedTrial",
    },
    "exporter": {
        "mjcf": "manitwin.assets.writers.mjcf:export",
        "urdf": "manitwin.assets.writers.urdf:export",
        "sdf": "manitwin.assets.writers.sdf:export",
        "usd": "manitwin.assets.writers.usd:export",
        "usdz": "manitwin.assets.writers.usd:export_usdz",
        "glb": "manitwin.assets.writers.glb:export",
        "robotwin": "manitwin.assets.writers.robotwin:export",
        "maniskill": "manitwin.assets.writers.maniskill:export",
        "isaaclab": "manitwin.assets.writers.isaaclab:export",
        "graspgen": "manitwin.assets.writers.graspgen:export",
        "isaac_grasp": "manitwin.assets.writers.isaac_grasp:export",
    },
}
