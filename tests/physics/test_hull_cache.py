"""Cooked hulls that are lent are one component's at a time."""

from __future__ import annotations

import pytest

from manitwin.physics.sapien import shapes
from manitwin.physics.sapien.body import dynamic_component
from manitwin.physics.sapien.shapes import HullCache
from rigid_boxes import block, box

TWO = (block([0, 0, 0], [0.1, 0.1, 0.1]), block([0.2, 0, 0], [0.3, 0.1, 0.1]))


def test_what_is_lent_is_not_lent_again_until_it_is_given_back() -> None:
    cache = HullCache()
    first, second = cache.take(TWO), cache.take(TWO)
    assert len(first) == 2
    assert not {id(shape) for shape in first} & {id(shape) for shape in second}
    cache.give_back(TWO, first)
    assert cache.take(tuple(hull.copy() for hull in TWO)) is first


def test_hulls_of_other_bodies_are_other_shapes() -> None:
    cache = HullCache()
    cube = box([0.04, 0.04, 0.04], 0.1).hulls
    cache.give_back(cube, cache.take(cube))
    assert len(cache.take(TWO)) == 2
    assert len(cache.take((TWO[1], TWO[0]))) == 2
    assert len(cache.take(cube)) == 1


def test_bodies_that_were_not_asked_for_lately_are_forgotten(monkeypatch) -> None:
    monkeypatch.setattr(shapes, "KEPT_HULLS", 2)
    cache = HullCache()
    kept = cache.take(TWO)
    cache.give_back(TWO, kept)
    cube = box([0.04, 0.04, 0.04], 0.1).hulls
    cache.give_back(cube, cache.take(cube))
    assert cache.take(TWO) is not kept


def test_a_block_borrows_each_body_its_own_set_and_a_failed_one_gives_none_back() -> None:
    cache = HullCache()
    with cache.lent([TWO, TWO]) as (first, second):
        assert first is not second
    with pytest.raises(KeyError), cache.lent([TWO]) as (failed,):
        raise KeyError
    assert cache.take(TWO) is not failed
    assert cache.take(TWO) is not failed


def test_a_shape_forgets_how_it_touched_in_the_scene_before() -> None:
    body = box([0.04, 0.04, 0.04], 0.1)
    cooked = shapes.hull_shapes(body.hulls)
    held = dynamic_component(body, cooked, contact_offset_m=0.001, soft_pad=True)
    assert cooked[0].patch_radius > 0
    del held
    dynamic_component(body, cooked, contact_offset_m=0.002)
    assert (cooked[0].patch_radius, cooked[0].min_patch_radius) == (0, 0)
    assert cooked[0].contact_offset == pytest.approx(0.002)
