"""Creation of the pose estimator that the user names: ``command:...``, or a server's address."""

from __future__ import annotations

from manitwin.config import ServicesConfig
from manitwin.errors import ConfigError
from manitwin.models.pose_estimators.command import CommandEstimator
from manitwin.models.pose_estimators.protocol import PoseEstimator
from manitwin.models.pose_estimators.served import ServedEstimator


def pose_estimator(spec: str, services: ServicesConfig) -> PoseEstimator:
    """Return the estimator that a spec names; raises ConfigError for an invalid spec."""
    kind, colon, rest = spec.partition(":")
    if kind == "command" and colon:
        return CommandEstimator(rest, services.timeout_s)
    if kind in ("http", "https"):
        return ServedEstimator(spec, services)
    raise ConfigError(
        f"--estimator {spec!r} is not a pose estimator; give 'command:PROGRAM {{request}} {{out}}' or http://HOST:PORT"
    )
