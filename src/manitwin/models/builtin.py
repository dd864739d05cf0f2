"""The backends that come with the package: no weights, no key."""

BACKENDS: dict[str, dict[str, str]] = {
    "generator": {"lift": "manitwin.models.generators.lift:LiftGenerator"},
    "annotator": {"rules": "manitwin.models.annotators.rules:RulesAnnotator"},
    "grasper": {"antipodal": "manitwin.models.graspers.antipodal:AntipodalGrasper"},
    "simulator": {
        "sapien": "manitwin.simulate.sapien_trial:SapienTrial",
        "mujoco": "manitwin.simulate.mujoco_trial:MujocoTrial",
    },
}
