"""The complete configuration of a build, with one section per stage."""

from __future__ import annotations

from typing import Any

from pydantic import Field, model_validator

from manitwin.config.grasps import GraspConfig, RobustnessConfig, SecondOpinionConfig, VerifyConfig
from manitwin.config.inputs import GenerateConfig, MattingConfig, NamingConfig, SourceConfig
from manitwin.config.run import RunConfig
from manitwin.config.section import Section, Seed
from manitwin.config.services import ServicesConfig, VlmConfig
from manitwin.config.shape import CollisionConfig, GateConfig, MeshConfig, PhysicalConfig, PlacementConfig
from manitwin.config.views import CandidatesConfig, ViewsConfig

RETIRED_SECTIONS = ("caption", "points", "finish")
"""Sections of earlier versions that had no settings; they are ignored if empty."""


class BuildConfig(Section):
    """All settings that determine the result of a build."""

    seed: Seed = 0
    generator: str = "lift"
    annotator: str = "rules"
    grasper: str = "antipodal"
    simulator: str = "sapien"
    second_simulator: str = "mujoco"
    grippers: tuple[str, ...] = Field(default=("panda",), min_length=1)
    source: SourceConfig = SourceConfig()
    matting: MattingConfig = MattingConfig()
    naming: NamingConfig = NamingConfig()
    generate: GenerateConfig = GenerateConfig()
    vlm: VlmConfig = VlmConfig()
    mesh: MeshConfig = MeshConfig()
    views: ViewsConfig = ViewsConfig()
    gate: GateConfig = GateConfig()
    physical: PhysicalConfig = PhysicalConfig()
    collision: CollisionConfig = CollisionConfig()
    candidates: CandidatesConfig = CandidatesConfig()
    grasps: GraspConfig = GraspConfig()
    verify: VerifyConfig = VerifyConfig()
    second_opinion: SecondOpinionConfig = SecondOpinionConfig()
    robustness: RobustnessConfig = RobustnessConfig()
    placement: PlacementConfig = PlacementConfig()
    services: ServicesConfig = ServicesConfig()
    run: RunConfig = RunConfig()

    @model_validator(mode="before")
    @classmethod
    def _without_retired(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        return {name: value for name, value in data.items() if value != {} or name not in RETIRED_SECTIONS}
