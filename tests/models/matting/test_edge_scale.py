"""The width of edges against steps whose blur is known."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.models.matting.edge_scale import edge_scale, narrow_edges
from manitwin.models.matting.outline import gradient_magnitude


def _step(height_lab: float, blur_px: float) -> np.ndarray:
    """L*a*b* (H, W, 3) of a step at column 60."""
    lab = np.zeros((80, 120, 3), np.float32)
    lab[..., 0] = 40
    lab[:, 60:, 0] += height_lab
    return np.asarray(cv2.GaussianBlur(lab, (0, 0), blur_px))


@pytest.mark.parametrize("height_lab", [6.0, 40.0])
@pytest.mark.parametrize("blur_px", [1.3, 2.0, 3.0])
def test_width_of_a_step_is_its_blur_whatever_its_height(height_lab: float, blur_px: float) -> None:
    assert edge_scale(_step(height_lab, blur_px))[40, 59:61] == pytest.approx(blur_px, rel=0.2)


def test_penumbra_of_a_strong_shadow_is_not_narrow_and_a_faint_outline_is() -> None:
    outline, penumbra = _step(40, 1.0), _step(30, 1.8)
    lab = np.concatenate([outline, penumbra, _step(8, 1.0)])
    narrow = narrow_edges(gradient_magnitude(lab), edge_scale(lab), 0.5, np.ones(lab.shape[:2], bool))
    assert narrow[20:60, 59:61].all() and narrow[180:220, 59:61].all()
    assert not narrow[100:140].any()


def test_specks_are_no_outline() -> None:
    lab = np.concatenate([_step(40, 1.0)] * 8)
    lab[100:102, 20:22, 0] = 52
    gradient = gradient_magnitude(lab)
    narrow = narrow_edges(gradient, edge_scale(lab), 0.5, np.ones(lab.shape[:2], bool))
    assert gradient[95:107, 15:27].max() > 2
    assert narrow[:, 55:65].any() and not narrow[:, 10:35].any()
