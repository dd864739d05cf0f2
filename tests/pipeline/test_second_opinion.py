"""The second engine: who is asked again, what is counted, and kappa over the jittered alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from grasp_drafts import PANDA, Scripted, number_of, proposed_draft, run_all
from manitwin.config import BuildConfig, SecondOpinionConfig, VerifyConfig
from manitwin.engine.stage import Draft
from manitwin.errors import UsageError
from manitwin.geometry.grasp_diversity import approach_octants
from manitwin.pipeline.quality import agreement_checks
from manitwin.pipeline.recipe import check_names, config_sha256
from manitwin.pipeline.second_opinion import FAILS, HOLDS, NOT_TRIED, SecondOpinionStage
from manitwin.pipeline.settings import SAMPLE_OF_HELD, Flags, with_flags
from manitwin.twin.grasp_summary import SecondOpinion


def held_always(pose: np.ndarray, settings: object) -> str:
    return "held"


OUTCOMES = ["held", "held", "slips", "held", "drops", "slips", "held", "slips", "held", "drops"]
HELD, FAILED = [0, 1, 3, 6], [2, 4, 5, 7]  # the last two are the unfiltered sample
SETTINGS = SecondOpinionConfig(jittered=3, share_of_failed=0.5)


def is_proposal(pose: np.ndarray) -> bool:
    return bool(pose[1, 3] == 0 == pose[2, 3])


def run(folder: Path, first: Scripted, second: Scripted, settings: SecondOpinionConfig = SETTINGS) -> Draft:
    draft = proposed_draft(folder, OUTCOMES, unfiltered=2)
    return run_all(draft, folder, SecondOpinionStage(settings, VerifyConfig(), first, second, PANDA))


def test_all_held_and_a_share_of_the_failed_are_tried_and_the_unfiltered_are_not(tmp_path: Path) -> None:
    first = Scripted(lambda pose, settings: "held")
    second = Scripted(lambda pose, settings: "slips" if is_proposal(pose) and number_of(pose) in {1, 2, 4} else "held")
    draft = run(tmp_path, first, second)
    assert (first.asked, second.asked) == (3, 4 + 2 + 3)
    arrays = np.load(draft.path("second_opinion.npz"))
    assert arrays["holds"][HELD].tolist() == [HOLDS, FAILS, HOLDS, HOLDS]
    assert arrays["outcome"][HELD].tolist() == ["held", "slips", "held", "held"]
    assert arrays["holds"][[8, 9]].tolist() == [NOT_TRIED, NOT_TRIED]
    tried = [i for i in FAILED if arrays["holds"][i] != NOT_TRIED]
    assert len(tried) == 2
    assert [arrays["holds"][i] for i in tried] == [FAILS if i in {2, 4} else HOLDS for i in tried]
    assert (arrays["outcome"] == "").tolist() == (arrays["holds"] == NOT_TRIED).tolist()
    record = SecondOpinion(**draft.field("second_opinion"))
    assert (record.held_tried, record.holds_share) == (4, 0.75)
    assert record.failed_tried == 2
    assert record.failed_pass_share == np.mean([i not in {2, 4} for i in tried])


def test_controls_are_jittered_grasps_that_held_and_kappa_is_over_them_alone(tmp_path: Path) -> None:
    def by_height(limit_m: float) -> Scripted:
        def outcome(pose: np.ndarray, settings: object) -> str:
            return "held" if pose[1, 3] <= limit_m else "drops"

        return Scripted(outcome)

    settings = SecondOpinionConfig(jittered=4, share_of_failed=1.0)
    draft = run(tmp_path, by_height(0.0), by_height(0.03), settings)
    arrays = np.load(draft.path("second_opinion.npz"))
    assert sorted(arrays["jittered_of"]) == HELD
    y_m = arrays["jittered_gripper_to_object"][:, 1, 3]
    first, second = y_m <= 0.0, y_m <= 0.03
    assert (arrays["jittered_outcome"] == "held").tolist() == first.tolist()
    assert arrays["jittered_holds"].astype(bool).tolist() == second.tolist()
    record = SecondOpinion(**draft.field("second_opinion"))
    assert (record.jittered, record.jittered_held, record.jittered_hold_in_second_engine) == (
        4,
        first.sum(),
        second.sum(),
    )
    assert record.jittered_agree == (first == second).sum()
    p, q = first.mean(), second.mean()
    chance = p * q + (1 - p) * (1 - q)
    assert first.sum() < second.sum() < 4, y_m
    assert chance < 1, "the draws of this seed are on both sides"
    assert record.kappa == pytest.approx(((first == second).mean() - chance) / (1 - chance))


def test_more_than_there_are_is_all_there_are_and_none_is_none(tmp_path: Path) -> None:
    for jittered, expected in ((100, 4), (0, 0)):
        folder = tmp_path / str(jittered)
        folder.mkdir()
        engine = Scripted(lambda pose, settings: "held")
        settings = SecondOpinionConfig(jittered=jittered, share_of_failed=0.0)
        record = SecondOpinion(**run(folder, engine, engine, settings).field("second_opinion"))
        assert record.jittered == expected
        assert (record.failed_tried, record.failed_pass_share) == (0, None)
        assert record.kappa is None, "where all hold, or none is there, chance alone agrees"


def test_jitter_draws_differ_by_seed_and_repeat_for_the_same(tmp_path: Path) -> None:
    engine = Scripted(lambda pose, settings: "held")
    poses = []
    for name, seed in (("a", 0), ("b", 0), ("c", 1)):
        (tmp_path / name).mkdir()
        draft = proposed_draft(tmp_path / name, OUTCOMES)
        draft.seed = seed
        run_all(draft, tmp_path / name, SecondOpinionStage(SETTINGS, VerifyConfig(), engine, engine, PANDA))
        poses.append(draft.path("second_opinion.npz").read_bytes())
    assert poses[0] == poses[1] != poses[2]


def test_key_knows_both_engines_and_the_trial(tmp_path: Path) -> None:
    one, other = Scripted(lambda *_: "held", "one"), Scripted(lambda *_: "held", "other")
    strong = VerifyConfig(force_n=80.0)
    stages = [
        SecondOpinionStage(SETTINGS, VerifyConfig(), one, other, PANDA),
        SecondOpinionStage(SETTINGS, VerifyConfig(), other, one, PANDA),
        SecondOpinionStage(SETTINGS, strong, one, other, PANDA),
    ]
    assert len({(stage.backend, stage.model) for stage in stages}) == 3


def test_a_sample_of_the_held_has_its_share_of_each_octant(tmp_path: Path) -> None:
    count, rng = 200, np.random.default_rng(3)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, 2] = rng.normal([0.7, 0, -1.5], 1.0, (count, 3))  # mostly one side
    stage = SecondOpinionStage(
        SecondOpinionConfig(sample_of_held=20), VerifyConfig(), Scripted(held_always), Scripted(held_always), PANDA
    )
    held = np.arange(0, count, 2)
    chosen = stage._sample(held, poses, np.random.default_rng(0))
    assert len(set(chosen)) == 20 and set(chosen) <= set(held) and sorted(chosen) == chosen.tolist()
    octants = approach_octants(poses)
    for octant in range(8):
        share = 20 * np.mean(octants[held] == octant)
        assert abs((octants[chosen] == octant).sum() - share) < 1 + 1e-9
    assert chosen.tolist() == stage._sample(held, poses, np.random.default_rng(0)).tolist()
    assert stage._sample(held[:20], poses, np.random.default_rng(0)).tolist() == held[:20].tolist()


def test_what_was_not_drawn_is_not_tried_and_the_check_says_how_sure_it_is(tmp_path: Path) -> None:
    settings = SecondOpinionConfig(jittered=0, share_of_failed=0.0, sample_of_held=5)
    draft = proposed_draft(tmp_path, ["held"] * 9, unfiltered=0)
    second = Scripted(lambda pose, settings: "held")
    run_all(draft, tmp_path, SecondOpinionStage(settings, VerifyConfig(), Scripted(held_always), second, PANDA))
    assert second.asked == 5
    assert sorted(np.load(draft.path("second_opinion.npz"))["holds"].tolist()) == [NOT_TRIED] * 4 + [HOLDS] * 5
    (check,) = agreement_checks({"second_opinion": draft.field("second_opinion"), "verified": 9})
    assert check.passed and check.message == "a sample of 5 of 9: 57 to 100 % (95 %)"
    (whole,) = agreement_checks({"second_opinion": draft.field("second_opinion"), "verified": 5})
    assert whole.message == ""


def test_agreement_of_every_grasp_cannot_be_had_from_a_sample() -> None:
    flags = Flags(second_opinion="sample", require_agreement=True)
    with pytest.raises(UsageError, match="tries a sample"):
        check_names(with_flags(BuildConfig(), flags))
    with pytest.raises(UsageError, match="quick skips"):
        with_flags(BuildConfig(), Flags(second_opinion="sample", quick=True))
    assert with_flags(BuildConfig(), Flags(second_opinion="sample")).second_opinion.sample_of_held == SAMPLE_OF_HELD
    sampled = BuildConfig(second_opinion=SecondOpinionConfig(sample_of_held=20))
    assert with_flags(sampled, Flags(second_opinion="all")) == BuildConfig()
    assert config_sha256(sampled) != config_sha256(BuildConfig())
