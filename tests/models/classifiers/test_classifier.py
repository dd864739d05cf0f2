"""Pictures whose truth is known by construction are named, or the classifier says that it cannot tell."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.models.annotators.prior_names import find_prior, named
from manitwin.models.classifiers.classifier import TEMPERATURE, classify, softmax
from manitwin.models.classifiers.efficientnet_lite import SIDE_PX, logits
from manitwin.models.classifiers.imagenet import CLASSES, load_limits, load_names
from manitwin.models.classifiers.object_pictures import object_pictures
from manitwin.models.classifiers.size_evidence import size_likelihoods
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.models.generators.templates.template_object import visual_parts
from manitwin.render.cameras import framing_camera
from manitwin.render.renderer import shared_renderer


def rendered(text: str, seed: int = 0) -> np.ndarray:
    templates = load_templates()
    wanted = read_text(text, templates)
    parts = visual_parts(make_object(templates[wanted.category], wanted, np.random.default_rng(seed)))
    points = np.concatenate([part.vertices for part in parts])
    camera = framing_camera(points, azimuth_deg=-70, elevation_deg=25, fov_y_deg=30, width_px=256, height_px=256)
    (frame,) = shared_renderer().render(parts, [camera])
    return np.dstack([frame.rgb, np.rint(255 * frame.coverage).astype(np.uint8)])


def test_every_name_is_one_that_the_priors_know_and_no_class_counts_twice() -> None:
    table = load_names()
    assert all(named(name) is not None and find_prior(name) is not None for name in (*table.names, *table.general))
    assert table.members.shape == (len(table.names), CLASSES) and table.members.sum(axis=0).max() == 1
    assert table.general_members.sum(axis=0).max() == 1
    assert load_limits().keys() == {*table.names, *table.general} and max(load_limits().values()) <= 1
    # what real photos of a folder, a calculator, a pencil box, a melon and pliers were called, surer than any render
    for name, wrong in (("envelope", 0.82), ("mobile phone", 0.866), ("remote control", 0.845), ("compact", 0.76)):
        assert load_limits()[name] >= wrong
    assert load_limits()["can opener"] >= 0.906
    # furniture and what else no hand holds is called by its name, and not by that of the likeliest small thing
    for name, classes in (
        ("chair", [423, 559, 765, 857]),
        ("television", [851]),
        ("piano", [579, 881]),
        ("chest", [492]),
    ):
        assert np.flatnonzero(table.members[table.names.index(name)]).tolist() == classes
    assert load_limits()["clock"] >= 0.94  # what a wrist watch was called
    hammer, cup = table.members[table.names.index("hammer")], table.members[table.names.index("cup")]
    assert np.flatnonzero(hammer).tolist() == [587] and np.flatnonzero(cup).tolist() == [967, 968]


def test_a_made_thing_is_named_and_the_estimate_says_by_whom() -> None:
    found = classify([rendered("a padlock")], 0.7)
    assert found.name == found.likeliest[0].name == "padlock"
    assert found.probability.source == "efficientnet-lite0"
    assert found.probability.low <= found.probability.value <= found.probability.high <= 1


def test_what_it_has_no_class_for_stays_unknown_with_the_likeliest() -> None:
    for text in ("a steel fork", "a clothespin", "a wooden hairbrush"):
        found = classify([rendered(text)], 0.7)
        assert found.name is None, text
        assert len(found.likeliest) == 3
        values = [guess.probability.value for guess in found.likeliest]
        assert values == sorted(values, reverse=True) and found.probability.value == values[0]


def test_a_certain_limit_names_nothing_and_pictures_are_averaged() -> None:
    hammer, plunger = rendered("a hammer"), rendered("a plunger")
    assert classify([plunger], 1.0).name is None
    both, one = classify([plunger, hammer], 0.5), classify([plunger], 0.5)
    other = classify([hammer], 0.5)
    share = {guess.name: guess.probability.value for guess in one.likeliest}["plunger"]
    rest = {guess.name: guess.probability.value for guess in other.likeliest}.get("plunger", 0.0)
    assert both.likeliest[0].name == "plunger"
    assert both.likeliest[0].probability.value == pytest.approx((share + rest) / 2, abs=0.02)


def test_the_pictures_centre_the_object_on_its_own_and_on_plain_ground() -> None:
    rgba = np.zeros((60, 100, 4), np.uint8)
    rgba[..., :3] = (0, 90, 0)
    rgba[10:50, 0:20] = (200, 0, 0, 255)  # at the border: beyond it the border goes on
    own, grey, white = object_pictures(rgba, 96)
    for picture in (own, grey, white):
        red = picture[..., 0].astype(int) - picture[..., 1] > 100
        rows, columns = np.nonzero(red)
        assert (rows.mean(), columns.max() - columns.min()) == pytest.approx((47.5, 60), abs=30)
        assert picture[48, 48].tolist() == [200, 0, 0]
    assert (
        own[2, 90].tolist() == [0, 90, 0] and grey[2, 90].tolist() == [127] * 3 and white[2, 90].tolist() == [255] * 3
    )
    with pytest.raises(ValueError, match="alpha is empty"):
        object_pictures(np.zeros((8, 8, 4), np.uint8), 96)


def test_the_plain_grounds_are_laid_under_the_object_before_it_is_made_smaller() -> None:
    rng = np.random.default_rng(5)
    rgba = rng.integers(0, 256, (200, 240, 4), dtype=np.uint8)
    rgba[:20, :, 3] = rgba[-20:, :, 3] = 0
    rgba[..., :20, 3] = rgba[..., -20:, 3] = 0
    rgba[21:179, 21:219, 3] |= 128
    own, *plain = object_pictures(rgba, 96)
    rows, columns = np.nonzero(rgba[..., 3] > 127)
    middle = (rows.min() + rows.max() + 1) / 2, (columns.min() + columns.max() + 1) / 2
    half = 0.6 * max(np.ptp(rows), np.ptp(columns)) + 0.6
    top, left = round(middle[0] - half), round(middle[1] - half)
    at = [np.clip(np.arange(first, first + round(2 * half)), 0, size - 1) for first, size in ((top, 200), (left, 240))]
    around = rgba[np.ix_(*at)].astype(float)
    alpha = around[..., 3:] / 255
    for picture, ground in ((own, None), (plain[0], 127), (plain[1], 255)):
        laid = around[..., :3] if ground is None else around[..., :3] * alpha + ground * (1 - alpha)
        assert np.abs(picture - cv2.resize(laid, (96, 96), interpolation=cv2.INTER_AREA)).max() <= 0.51


def test_probabilities_are_those_of_the_closed_form() -> None:
    assert softmax(np.log([[1.0, 2.0, 5.0]])) == pytest.approx(np.array([[0.125, 0.25, 0.625]]))


def test_a_known_size_counts_by_bayes_rule_and_the_source_says_so() -> None:
    picture = rendered("a mug")
    table, weights = load_names(), size_likelihoods(0.11)
    shares = softmax(logits(object_pictures(picture, SIDE_PX)) / TEMPERATURE).mean(axis=0) * weights
    found = classify([picture], 0.7, longest_m=0.11)
    for guess in found.likeliest:
        members = table.members[table.names.index(guess.name)]
        assert guess.probability.value == pytest.approx(shares[members].sum() / shares.sum(), rel=1e-9)
        assert guess.probability.low <= guess.probability.value <= guess.probability.high
        assert guess.probability.source == "efficientnet-lite0+size"


def test_what_is_too_long_for_a_mug_is_less_of_one() -> None:
    def of_mug(longest_m: float | None) -> float:
        said = classify([rendered("a mug")], 0.7, longest_m).likeliest
        return {guess.name: guess.probability.value for guess in said}.get("mug", 0.0)

    assert of_mug(0.11) > of_mug(None) > of_mug(0.6)
