"""Models that are made once."""

from __future__ import annotations

import pytest

import seen_solids
from manitwin.scenes.locate.pose_model import PoseModel


@pytest.fixture(scope="package")
def stool() -> PoseModel:
    """A body without any symmetry."""
    return PoseModel.of_mesh("stool", seen_solids.stool())


@pytest.fixture(scope="package")
def jar() -> PoseModel:
    """A cylinder with one knob."""
    return PoseModel.of_mesh("jar", seen_solids.jar())
