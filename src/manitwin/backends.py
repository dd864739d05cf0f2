"""The protocols that a backend of your own follows: five of them, with what each is asked and what it answers.

Raise ``BackendError`` or one of its kinds where the backend fails (the item stays resumable), ``Rejected`` where the input
is at fault.
"""

from manitwin.assets.writers.exporter import Exported, Exporter, FormatNotes, TwinContent
from manitwin.config import BuildConfig, Resource
from manitwin.errors import (
    AccessDenied,
    BackendError,
    BadReply,
    ConfigError,
    ExportError,
    RateLimited,
    Rejected,
    Unavailable,
    Unsupported,
)
from manitwin.geometry.rigid_body import RigidBody
from manitwin.models.annotators.protocol import (
    Annotator,
    PhysicalEstimates,
    PointsRequest,
    QualityVerdict,
    SelectedPoints,
    Subject,
)
from manitwin.models.generators.protocol import IMAGE_OR_TEXT, Asked, Generated, GenerationRequest, Generator, JobState
from manitwin.models.graspers.protocol import Grasper, GraspProposals, GraspRequest
from manitwin.physics.trial import GraspTrial, TrialResult, TrialSettings
from manitwin.robots.grippers.gripper import Gripper
from manitwin.twin.point_records import FunctionalPoint, GraspPoint
from manitwin.twin.record import Language
from manitwin.twin.record_values import Estimate

__all__ = [
    "IMAGE_OR_TEXT",
    "AccessDenied",
    "Annotator",
    "Asked",
    "BackendError",
    "BadReply",
    "BuildConfig",
    "ConfigError",
    "Estimate",
    "ExportError",
    "Exported",
    "Exporter",
    "FormatNotes",
    "FunctionalPoint",
    "Generated",
    "GenerationRequest",
    "Generator",
    "GraspPoint",
    "GraspProposals",
    "GraspRequest",
    "GraspTrial",
    "Grasper",
    "Gripper",
    "JobState",
    "Language",
    "PhysicalEstimates",
    "PointsRequest",
    "QualityVerdict",
    "RateLimited",
    "Rejected",
    "Resource",
    "RigidBody",
    "SelectedPoints",
    "Subject",
    "TrialResult",
    "TrialSettings",
    "TwinContent",
    "Unavailable",
    "Unsupported",
]
