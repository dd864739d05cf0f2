"""The drawn gripper against the gripper's own numbers."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.render.card_panels import gripper_body, gripper_fork
from manitwin.robots.grippers.gripper import load_gripper


@pytest.mark.parametrize("opening_m", [0.0, 0.03, 0.08])
def test_fork_has_the_gripper_s_opening_and_reach(opening_m: float) -> None:
    gripper = load_gripper("panda")
    boxes = gripper.boxes(opening_m)
    fork, body = gripper_fork(boxes, 0.004), gripper_body(boxes)
    tips = fork.vertices[fork.vertices[:, 2] > gripper.tip_depth_m - 0.01]
    assert np.abs(tips[:, 0]).min() == pytest.approx(opening_m / 2, abs=2.5e-4)
    assert fork.vertices[:, 2].max() == pytest.approx(body.vertices[:, 2].max() + 0.002, abs=1e-6)
