"""The backends that come with the package. What needs a key, a server or a program says so when it is created."""

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
        "antipodal": "manitwin.models.graspers.antipodal:AntipodalGrasper",
        "suction": "manitwin.models.graspers.suction:SuctionGrasper",
        "postures": "manitwin.models.graspers.postures:PostureGrasper",
        "graspgen": "manitwin.models.graspers.graspgen:GraspGenGrasper",
        "graspgenx": "manitwin.models.graspers.graspgenx:GraspGenXGrasper",
    },
    "simulator": {
        "sapien": "manitwin.simulate.sapien_trial:SapienTrial",
        "mujoco": "manitwin.simulate.mujoco_trial:MujocoTrial",
        "statics": "manitwin.simulate.suction_trial:SuctionTrial",
        "sapien_articulation": "manitwin.simulate.sapien_fingers:ArticulatedTrial",
    },
    "exporter": {
        "mjcf": "manitwin.export.mjcf:export",
        "urdf": "manitwin.export.urdf:export",
        "sdf": "manitwin.export.sdf:export",
        "usd": "manitwin.export.usd:export",
        "usdz": "manitwin.export.usdz:export",
        "glb": "manitwin.export.glb:export",
        "robotwin": "manitwin.export.robotwin:export",
        "maniskill": "manitwin.export.maniskill:export",
        "isaaclab": "manitwin.export.isaaclab:export",
        "graspgen": "manitwin.export.graspgen:export",
        "isaac_grasp": "manitwin.export.isaac_grasp:export",
    },
}
