"""The sample stands for the set; queues share it; both are what the seed gives."""

from __future__ import annotations

from collections import Counter

import pytest

from manitwin.dataset.review.queues import Plan, queue_of
from manitwin.dataset.review.sample import SampledTwin, strata_counts, stratified_sample
from manitwin.errors import UsageError

KINDS = ("mug", "bowl", "pen", "pan")
SET = [
    SampledTwin(f"t{n:04d}", KINDS[n % 7 % 4], 0.03 * (1 + n % 11), "mesh" if n % 3 else "image") for n in range(1000)
]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_every_stratum_has_its_share_rounded_down_or_up(seed: int) -> None:
    chosen = set(stratified_sample(SET, 200, seed))
    assert len(chosen) == 200
    for kind in (lambda t: t.stratum[:1], lambda t: t.stratum[:2], lambda t: t.stratum):
        total, sampled = Counter(map(kind, SET)), Counter(kind(t) for t in SET if t.twin_id in chosen)
        assert all(abs(sampled[stratum] - count / 5) < 1 for stratum, count in total.items())


def test_every_twin_is_as_likely_as_any_other() -> None:
    """200 draws of 20 of 200: a mean of 20, and for a fair coin of that kind no count beyond 6 standard deviations."""
    counts = Counter(twin_id for seed in range(200) for twin_id in stratified_sample(SET[:200], 20, seed))
    assert len(counts) == 200
    assert max(abs(count - 20) for count in counts.values()) < 6 * (20 * 0.9) ** 0.5


def test_same_seed_same_sample_whatever_the_order_of_the_set() -> None:
    one = stratified_sample(SET, 50, 1)
    assert one == stratified_sample(SET[::-1], 50, 1) != stratified_sample(SET, 50, 2)
    assert set(stratified_sample(SET[:9], 500, 1)) == {t.twin_id for t in SET[:9]}, "all, where there are no more"
    assert strata_counts(SET[:8], ["t0000"])["mug"] == (1, 3)
    with pytest.raises(UsageError, match="give 1 or more"):
        stratified_sample(SET, 0, 1)


def test_queues_cover_the_sample_and_overlap_by_the_share_that_is_asked_for() -> None:
    plan = Plan(tuple(t.twin_id for t in SET), seed=1, overlap=0.2)
    names = ["ada", "ben", "eva"]
    own = {name: [t for t in plan.twins if name in plan.assigned(t, names)] for name in names}
    times = Counter(t for twins in own.values() for t in twins)
    assert set(times) == set(plan.twins)
    assert 160 < sum(count == 2 for count in times.values()) < 240, "20 % of 1,000, 3 standard deviations"
    assert all(count <= 2 for count in times.values())
    assert max(map(len, own.values())) - min(map(len, own.values())) < 100


def test_a_queue_has_ones_own_first_and_then_what_others_have_left() -> None:
    plan = Plan(tuple(t.twin_id for t in SET[:40]), seed=1, overlap=0.0)
    names = ["ada", "ben"]
    own = [t for t in plan.twins if plan.assigned(t, names) == ("ada",)]
    queue = queue_of("ada", plan, names, {})
    assert queue[: len(own)] == own and set(queue) == set(plan.twins)
    done = {t: {"ada"} for t in own[:3]} | {t: {"ben"} for t in plan.twins if t not in own}
    assert queue_of("ada", plan, names, done) == own[3:]


def test_who_joins_moves_nothing_between_the_others() -> None:
    plan = Plan(tuple(t.twin_id for t in SET[:300]), seed=1, overlap=0.0)
    before = {t: plan.assigned(t, ["ada", "ben"])[0] for t in plan.twins}
    after = {t: plan.assigned(t, ["ada", "ben", "eva"])[0] for t in plan.twins}
    assert {after[t] for t in plan.twins if after[t] != before[t]} == {"eva"}
