"""Profiles of bodies of revolution: what rises beside the axis is no part of them."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.models.generators.lift.primitives import profile, rows_on_axis
from manitwin.models.generators.lift.revolution import half_widths
from manitwin.models.generators.lift.silhouette import analyse_silhouette

TOP, BOTTOM, EAR = 120, 360, 20


def _eared() -> np.ndarray:
    """Return the mask of a body, as wide as 160 px about column 200, with an ear on its right side."""
    mask = np.zeros((400, 400), bool)
    mask[TOP:BOTTOM, 120:280] = True
    mask[TOP - EAR : TOP, 250:280] = True
    return mask


def test_an_ear_beside_the_axis_makes_no_needle_on_the_end() -> None:
    silhouette = analyse_silhouette(_eared())
    rows, radii = profile(silhouette)
    assert len(rows) == pytest.approx(BOTTOM - TOP, abs=3)
    assert radii.min() > 0.9 * radii.max()
    rows, widths, column = half_widths(_eared())
    assert (rows[0], rows[-1]) == (TOP, BOTTOM - 1) and column == pytest.approx(199.5, abs=1)
    assert widths.min() > 0.9 * widths.max()


def test_a_needle_at_the_axis_stays() -> None:
    mask = np.zeros((400, 400), bool)
    mask[200:300, 150:250] = True
    mask[60:200, 200] = True
    assert rows_on_axis(mask, 199.5).tolist() == list(range(60, 300))
    rows, _ = profile(analyse_silhouette(mask))
    assert len(rows) == pytest.approx(240, abs=3)
