"""Cooked hulls that are lent are one component's at a time."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.physics.sapien import shapes
from manitwin.physics.sapien.body import dynamic_component
from manitwin.physics.sapien.shapes import HullCache
from rigid_boxes import block, box

TWO = (block([0, 0, 0], [0.1, 0.1, 0.1]), block([0.2, 0, 0], [0.3, 0.1, 0.1]))


def lent(cache: HullCache, hulls: tuple[np.ndarray, ...]) -> shapes.HullShapes:
    """Borrow the shapes of hulls for an empty block."""
    with cache.lent([hulls]) as (borrowed,):
        return borrowed


def test_what_is_lent_is_not_lent_again_until_the_block_ends() -> None:
    cache = HullCache()
    with cache.lent([TWO, TWO]) as (first, second), cache.lent([TWO]) as (third,):
        assert len(first) == 2
        assert len({id(shape) for lot in (first, second, third) for shape in lot}) == 6
    with cache.lent([tuple(hull.copy() for hull in TWO)]) as (again,):
        assert again in (first, second, third)


def test_hulls_of_other_bodies_are_other_shapes() -> None:
    cache = HullCache()
    cube = box([0.04, 0.04, 0.04], 0.1).hulls
    lent(cache, cube)
    assert len(lent(cache, TWO)) == 2
    assert len(lent(cache, (TWO[1], TWO[0]))) == 2
    assert len(lent(cache, cube)) == 1


def test_bodies_that_were_not_asked_for_lately_are_forgotten(monkeypatch) -> None:
    monkeypatch.setattr(shapes, "KEPT_HULLS", 2)
    cache = HullCache()
    kept = lent(cache, TWO)
    assert lent(cache, TWO) is kept
    lent(cache, box([0.04, 0.04, 0.04], 0.1).hulls)
    assert lent(cache, TWO) is not kept


def test_what_a_failed_scene_may_still_hold_is_not_lent_again() -> None:
    cache = HullCache()
    with pytest.raises(KeyError), cache.lent([TWO]) as (failed,):
        raise KeyError
    assert lent(cache, TWO) is not failed


def test_a_shape_forgets_how_it_touched_in_the_scene_before() -> None:
    body = box([0.04, 0.04, 0.04], 0.1)
    cooked = shapes.hull_shapes(body.hulls)
    held = dynamic_component(body, cooked, contact_offset_m=0.001, soft_pad=True)
    assert cooked[0].patch_radius > 0
    del held
    dynamic_component(body, cooked, contact_offset_m=0.002)
    assert (cooked[0].patch_radius, cooked[0].min_patch_radius) == (0, 0)
    assert cooked[0].contact_offset == pytest.approx(0.002)
