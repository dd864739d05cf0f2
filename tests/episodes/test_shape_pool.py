"""Lent shapes are one component's at a time."""

from __future__ import annotations

from manitwin.physics.sapien import shape_pool
from manitwin.physics.sapien.shape_pool import ShapePool
from rigid_boxes import block, box

TWO = (block([0, 0, 0], [0.1, 0.1, 0.1]), block([0.2, 0, 0], [0.3, 0.1, 0.1]))


def test_what_is_lent_is_not_lent_again_until_it_is_given_back() -> None:
    pool = ShapePool()
    first, second = pool.take(TWO), pool.take(TWO)
    assert len(first) == 2
    assert not {id(shape) for shape in first} & {id(shape) for shape in second}
    pool.give_back(TWO, first)
    assert pool.take(tuple(hull.copy() for hull in TWO)) is first


def test_hulls_of_other_bodies_are_other_shapes() -> None:
    pool = ShapePool()
    cube = box([0.04, 0.04, 0.04], 0.1).hulls
    pool.give_back(cube, pool.take(cube))
    assert len(pool.take(TWO)) == 2
    assert len(pool.take((TWO[1], TWO[0]))) == 2
    assert len(pool.take(cube)) == 1


def test_bodies_that_were_not_asked_for_lately_are_forgotten(monkeypatch) -> None:
    monkeypatch.setattr(shape_pool, "KEPT_BODIES", 1)
    pool = ShapePool()
    kept = pool.take(TWO)
    pool.give_back(TWO, kept)
    cube = box([0.04, 0.04, 0.04], 0.1).hulls
    pool.give_back(cube, pool.take(cube))
    assert pool.take(TWO) is not kept
