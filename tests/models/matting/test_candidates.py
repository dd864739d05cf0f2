"""What opinions see otherwise: a part in focus that one lacks, a hole that one fills, and who is outvoted."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from manitwin.models.matting.candidates import Candidate, candidates, disputed_share, lost_parts
from manitwin.models.matting.segmentation import Segmentation, segment

SIZE = (300, 400)
CENTER = (200, 150)


@cache
def ring_found() -> tuple[Segmentation, np.ndarray]:
    """Return what rules find of a ring on plain ground, and its true mask."""
    truth = cv2.ellipse(np.zeros(SIZE, np.uint8), CENTER, (110, 80), 0, 0, 360, 1, -1)
    truth = cv2.ellipse(truth, CENTER, (50, 35), 0, 0, 360, 0, -1)
    scene = np.full((*SIZE, 3), (205.0, 200.0, 190.0)) + np.random.default_rng(0).normal(0, 1.5, (*SIZE, 3))
    scene[truth > 0] = (30, 90, 160)
    photo = np.clip(cv2.GaussianBlur(scene, (0, 0), 0.8), 0, 255).astype(np.uint8)
    return segment(photo), truth > 0


def made(*shares: np.ndarray) -> dict[str, Candidate]:
    return {each.maker: each for each in candidates(ring_found()[0], [s.astype(np.float32) for s in shares], zoom=1.0)}


def overlap(one: np.ndarray, other: np.ndarray) -> float:
    return float((one & other).sum() / (one | other).sum())


def filled() -> np.ndarray:
    return cv2.ellipse(np.zeros(SIZE, np.uint8), CENTER, (110, 80), 0, 0, 360, 1, -1) > 0


def half() -> np.ndarray:
    truth = ring_found()[1].copy()
    truth[:, CENTER[0] :] = False
    return truth


def said(mask: np.ndarray, beyond: float = 0.0) -> np.ndarray:
    """A network's share of object: sure of a mask, and as sure as said of the ground beyond it."""
    return np.where(mask, 1.0, beyond).astype(np.float32)


def test_one_network_is_one_candidate_and_a_second_has_its_own_name() -> None:
    truth = ring_found()[1]
    assert set(made(truth)) == {"rules", "network"}
    assert set(made(truth, filled())) == {"rules", "network", "built_in_network"}
    assert set(made(np.zeros(SIZE), truth)) == {"rules", "built_in_network"}, "what is empty is no candidate"


def test_a_filled_hole_in_focus_is_counted_by_its_area() -> None:
    both = made(filled())
    hole = int((filled() & ~ring_found()[1]).sum())
    area = disputed_share(both["network"], [both["rules"]], said(filled())) * filled().sum()
    assert area == pytest.approx(hole, rel=0.1)


def test_a_lost_part_is_counted_and_agreement_is_not() -> None:
    truth = ring_found()[1]
    agreeing, cut = made(truth), made(half())
    assert disputed_share(agreeing["network"], [agreeing["rules"]], said(truth)) < 0.01
    assert disputed_share(cut["network"], [cut["rules"]], said(half())) == pytest.approx(1.0, abs=0.25), (
        "as much again as it has"
    )


def test_what_a_third_sees_alone_is_outvoted_where_rules_and_a_network_agree() -> None:
    truth = ring_found()[1]
    three = made(filled(), truth)
    others = [three["rules"], three["network"]]
    assert disputed_share(three["built_in_network"], others, said(truth)) < 0.01
    assert disputed_share(three["rules"], [three["network"], three["built_in_network"]], said(truth)) < 0.01
    assert disputed_share(three["network"], [three["rules"], three["built_in_network"]], said(truth)) > 0.05, (
        "two networks are not enough"
    )


def test_parts_that_rules_alone_found_are_joined_to_what_the_network_found() -> None:
    truth = ring_found()[1]
    joined = made(half())["both"]
    assert overlap(joined.found.mask, truth) > 0.97
    assert joined.by_network and not joined.independent
    assert disputed_share(joined, [made(half())["rules"]], said(half())) < 0.01


def test_a_piece_of_soft_outline_is_no_part() -> None:
    found, truth = ring_found()
    beside = cv2.ellipse(np.zeros(SIZE, np.uint8), (345, 235), (40, 25), 0, 0, 360, 1, -1) > 0
    taken = replace(found, mask=found.mask | beside)  # of plain ground, as a shadow that was taken for a part
    assert not lost_parts(taken.mask, found, said(truth)).any()
    assert "both" not in {each.maker for each in candidates(taken, [truth.astype(np.float32)], zoom=1.0)}


def test_what_lies_within_is_a_part_unless_it_has_the_ground_s_colour() -> None:
    found, truth = ring_found()
    notched = truth.copy()
    notched[60:75, 190:210] = False  # of the ring's own colour
    seen = replace(found, mask=notched)
    assert (lost_parts(truth, seen, said(notched)) & ~notched).sum() > 0.8 * (truth & ~notched).sum()
    assert not lost_parts(filled(), replace(found, mask=truth, narrow=np.zeros_like(truth)), said(truth, 0.3)).any(), (
        "a hole"
    )


def test_what_runs_out_of_the_picture_beside_the_thing_is_ground_and_no_lost_part() -> None:
    found, truth = ring_found()
    joint = np.zeros(SIZE, bool)
    joint[262:272, :] = True  # of two boards: as sharp as the thing, apart from it
    narrow = found.narrow | joint
    rules, network = replace(found, mask=truth | joint, narrow=narrow), replace(found, mask=truth, narrow=narrow)
    one, other, unsure = made(truth)["network"], made(truth)["rules"], said(truth, 0.3)
    seen = replace(one, found=network)
    assert disputed_share(seen, [replace(other, found=rules)], unsure) == 0.0
    assert not lost_parts(rules.mask, network, unsure).any()
    within = joint.copy()
    within[:, :30] = within[:, -30:] = False  # the same, wholly in the picture, may be a part
    inner = replace(rules, mask=truth | within)
    assert disputed_share(seen, [replace(other, found=inner)], unsure) > 0.05
    assert (lost_parts(inner.mask, network, unsure) & within).sum() > 0.8 * within.sum()


def test_what_runs_out_of_the_picture_from_the_thing_is_still_a_doubt() -> None:
    found, truth = ring_found()
    handle = np.zeros(SIZE, bool)
    handle[140:160, 300:] = True
    handle &= ~truth
    narrow = found.narrow | handle
    one, other = made(truth)["network"], made(truth)["rules"]
    seen = replace(one, found=replace(found, mask=truth, narrow=narrow))
    assert (
        disputed_share(
            seen, [replace(other, found=replace(found, mask=truth | handle, narrow=narrow))], said(truth, 0.3)
        )
        > 0.05
    )


def test_the_sharp_shadow_that_rules_take_for_a_part_is_none_where_the_network_is_sure_of_the_ground() -> None:
    found, truth = ring_found()
    shadow = cv2.ellipse(np.zeros(SIZE, np.uint8), (345, 235), (40, 25), 0, 0, 360, 1, -1) > 0
    narrow = found.narrow | shadow  # in focus
    lab = np.where(shadow[..., None], found.background.lab * np.float32(0.8), found.background.lab)
    dark = replace(found, background=replace(found.background, lab=lab), narrow=narrow)
    rules, network = (replace(dark, mask=mask) for mask in (truth | shadow, truth))
    seen, other = (replace(made(truth)[maker], found=each) for maker, each in (("network", network), ("rules", rules)))
    assert disputed_share(seen, [other], said(truth)) == 0.0 and not lost_parts(rules.mask, network, said(truth)).any()
    unsure = said(truth, 0.2)
    assert disputed_share(seen, [other], unsure) > 0.05 and lost_parts(rules.mask, network, unsure).any()
    another_colour = replace(found.colours, certain=found.colours.certain | shadow)
    for changed in (
        {"colours": another_colour},
        {"background": found.background},
    ):  # the latter: as light as the ground
        unlike = [replace(each, found=replace(each.found, **changed)) for each in (seen, other)]
        assert disputed_share(unlike[0], unlike[1:], said(truth)) > 0.05
        assert lost_parts(rules.mask, unlike[0].found, said(truth)).any()
