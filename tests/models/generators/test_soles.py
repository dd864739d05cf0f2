"""Inflated outlines that stand: on their soles, with no part of the outline cut off."""

import cv2
import numpy as np
import pytest

from manitwin.models.generators.lift.hint import ShapeHint
from manitwin.models.generators.lift.lifting import lift
from manitwin.models.generators.lift.soles import extend_feet
from manitwin.models.generators.lift.surface import tip_angle_deg

STANDS = ShapeHint(stands=True)


def _figure(*, back_foot_px: int) -> np.ndarray:
    """Return a figure (H, W, 4) of a head, a body and two legs, one of which ends ``back_foot_px`` above the other."""
    alpha = np.zeros((420, 360), np.uint8)
    cv2.circle(alpha, (180, 120), 80, 255, -1)
    cv2.ellipse(alpha, (180, 240), (75, 90), 0, 0, 360, 255, -1)
    cv2.rectangle(alpha, (125, 280), (165, 399), 255, -1)
    cv2.rectangle(alpha, (195, 280), (235, 399 - back_foot_px), 255, -1)
    rgba = np.dstack([np.full((*alpha.shape, 3), (180, 90, 40), np.uint8), alpha])
    rgba[380:, :, :3] = (20, 20, 200)  # shoes
    return rgba


@pytest.mark.parametrize("back_foot_px", [0, 20])
def test_a_figure_keeps_its_feet_and_both_stand_on_the_ground(back_foot_px: int) -> None:
    lifted = lift(_figure(back_foot_px=back_foot_px), STANDS)
    assert [lifted.notes[each] for each in ("primitive", "rests", "base")] == ["inflation", "standing", "soles"]
    vertices = lifted.surface.vertices
    # 360 px from crown to soles, 160 px wide
    assert np.ptp(vertices[:, 1]) / np.ptp(vertices[:, 0]) == pytest.approx(360 / 160, rel=0.03)
    ground = vertices[vertices[:, 1] < 1e-3]
    assert (ground[:, 0] < -0.02).any()
    assert (ground[:, 0] > 0.02).any()
    assert not (np.abs(ground[:, 0]) < 0.02).any()  # the gap between the legs is open
    assert tip_angle_deg(lifted.surface) >= 5


@pytest.mark.slow
def test_the_overlap_is_that_of_what_stands() -> None:
    level, staggered = (lift(_figure(back_foot_px=px), STANDS).explained.silhouette_iou for px in (0, 20))
    assert level > 0.97
    assert level - 0.03 < staggered < level  # the rear foot was made longer


def test_feet_go_down_to_the_lowest_row_and_what_ends_higher_does_not() -> None:
    mask = _figure(back_foot_px=20)[..., 3] > 127
    height = int(np.ptp(np.nonzero(mask.any(axis=1))[0])) + 1
    footed, near = extend_feet(mask, 0.09), extend_feet(mask, 0.0)
    assert 0.09 * height > 20
    assert footed[399, 195:236].all()
    assert not near[399, 195:236].any()
    assert not footed[399, 166:195].any()
    assert (footed[: len(mask)] & mask).sum() == mask.sum()


def test_an_underside_that_a_slight_cut_makes_flat_is_cut() -> None:
    rgba = _figure(back_foot_px=0)
    rgba[280:400, 125:235, 3] = rgba[200:240, 250:330, 3] = 255  # one broad base, and an arm
    assert lift(rgba, STANDS).notes["base"] == "cut"
