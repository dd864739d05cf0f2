"""The backends that come with the package: no weights, no key."""

BACKENDS: dict[str, dict[str, str]] = {
    "generator": {"lift": "manitwin.models.generators.lift:LiftGenerator"},
    "annotator": {"rules": "manitwin.models.annotators.rules:RulesAnnotator"},
    "grasper": {
        "antipodal": "manitwin.models.graspers.antipodal:AntipodalGrasper",
        "suction": "manitwin.models.graspers.suction:SuctionGrasper",
        "postures": "manitwin.models.graspers.postures:PostureGrasper",
    },
    "simulator": {
        "sapien": "manitwin.simulate.sapien_trial:SapienTrial",
        "mujoco": "manitwin.simulate.mujoco_trial:MujocoTrial",
        "statics": "manitwin.simulate.suction_trial:SuctionTrial",
        "sapien_articulation": "manitwin.simulate.sapien_fingers:ArticulatedTrial",
    },
}
