"""The immutable configuration of a build: one section per stage, with the paper's numbers as defaults.

A section is part of the key of its stage: changing a value re-runs that stage and all stages that depend on it.
"""

from manitwin.config.build import BuildConfig
from manitwin.config.grasps import GraspConfig, RobustnessConfig, SecondOpinionConfig, VerifyConfig
from manitwin.config.inputs import GenerateConfig, MattingConfig, NamingConfig, SourceConfig
from manitwin.config.load import load_config, read_toml, validate_settings
from manitwin.config.run import MOST_SLOTS, Resource, RunConfig
from manitwin.config.section import LARGEST_COUNT, LARGEST_SEED, NO_SETTINGS, Section, Seed
from manitwin.config.services import ServicesConfig, VlmConfig
from manitwin.config.shape import CollisionConfig, GateConfig, MeshConfig, PhysicalConfig, PlacementConfig, RepairConfig
from manitwin.config.views import CandidatesConfig, ViewsConfig

__all__ = [
    "LARGEST_COUNT",
    "LARGEST_SEED",
    "MOST_SLOTS",
    "NO_SETTINGS",
    "BuildConfig",
    "CandidatesConfig",
    "CollisionConfig",
    "GateConfig",
    "GenerateConfig",
    "GraspConfig",
    "MattingConfig",
    "MeshConfig",
    "NamingConfig",
    "PhysicalConfig",
    "PlacementConfig",
    "RepairConfig",
    "Resource",
    "RobustnessConfig",
    "RunConfig",
    "SecondOpinionConfig",
    "Section",
    "Seed",
    "ServicesConfig",
    "SourceConfig",
    "VerifyConfig",
    "ViewsConfig",
    "VlmConfig",
    "load_config",
    "read_toml",
    "validate_settings",
]
