"""Agreement against published values: Gwet's and Krippendorff's own example of four raters."""

from __future__ import annotations

import pytest

from manitwin.dataset.review.agreement import agreement_of, gwet_ac1, raw_agreement

# cac.raw4raters of Gwet's irrCAC, which is the example of K. Krippendorff, "Computing Krippendorff's alpha-reliability" (2011), C
FOUR_RATERS = """
1 1 . 1
2 2 3 2
3 3 3 3
3 3 3 3
2 2 2 2
1 2 3 4
4 4 4 4
1 1 2 1
2 2 2 2
. 5 5 5
. . 1 1
. . 3 .
"""
RATINGS = {
    f"unit {unit}": {f"rater {rater}": label for rater, label in enumerate(line.split()) if label != "."}
    for unit, line in enumerate(FOUR_RATERS.strip().splitlines())
}


def test_published_example_of_four_raters_with_missing_ratings() -> None:
    found = agreement_of(RATINGS, "12345")
    assert found.items == 11
    assert found.raw == pytest.approx(0.81818, abs=1e-5)
    assert found.alpha == pytest.approx(0.743, abs=5e-4)  # Krippendorff 2011, nominal data
    assert found.ac1 == pytest.approx(0.77544, abs=1e-5)  # irrCAC: gwet.ac1.raw(cac.raw4raters)


def test_nearly_all_yes_is_where_alpha_falls_and_ac1_does_not() -> None:
    """Two raters, 118 times yes, 2 and 5 contradictions: the paradox that AC1 was made for (Gwet 2008, table 2)."""
    pairs = [("yes", "yes")] * 118 + [("yes", "no")] * 5 + [("no", "yes")] * 2
    ratings = {str(place): dict(zip("ab", pair, strict=True)) for place, pair in enumerate(pairs)}
    found = agreement_of(ratings, ["yes", "no"])
    assert found.raw == pytest.approx(0.944, abs=1e-3) and found.ac1 == pytest.approx(0.941, abs=1e-3)
    assert found.alpha is not None and found.alpha < 0


def test_what_cannot_be_told_is_not() -> None:
    assert agreement_of({"t": {"ada": "yes"}}, ["yes", "no"]).raw is None
    assert gwet_ac1([{"ada": "yes"}], ["yes", "no"]) is None
    same = agreement_of({str(n): {"ada": "yes", "ben": "yes"} for n in range(5)}, ["yes", "no", "unsure"])
    assert (same.raw, same.alpha, same.ac1) == (1.0, None, 1.0), "alpha has nothing to tell from chance"
    assert raw_agreement([{"a": "yes", "b": "no", "c": "no"}]) == pytest.approx(1 / 3)
