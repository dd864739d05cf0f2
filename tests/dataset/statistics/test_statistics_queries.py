"""The report's SQL gives what the same rows give when counted another way."""

from __future__ import annotations

import hashlib
from collections import Counter
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from scipy.stats import binomtest
from synthetic_index import identities, synthetic_tables

from manitwin.dataset.statistics import grasp_queries, object_queries, stage_queries
from manitwin.dataset.statistics.query import Query, ReportTables, Row
from manitwin.models.annotators.priors import load_priors
from manitwin.twin.record import REJECTION_REASONS

Rows = list[dict[str, Any]]


@pytest.fixture(scope="module")
def arrow() -> dict[str, pa.Table]:
    return synthetic_tables(150, 60)


@pytest.fixture(scope="module")
def tables(arrow: dict[str, pa.Table]) -> ReportTables:
    return ReportTables(arrow)


@pytest.fixture(scope="module")
def rows(arrow: dict[str, pa.Table]) -> dict[str, Rows]:
    return {name: table.to_pylist() for name, table in arrow.items()}


def by(tables: ReportTables, query: Query, key: str) -> dict[str, Row]:
    return {row[key]: row for row in tables.result(query).rows}


def own(grasp: Row) -> bool:
    return not grasp["proposer"].endswith((":unfiltered", ":jittered"))


@pytest.mark.parametrize("passed, count", [(0, 7), (7, 7), (1, 3), (150, 210), (99_999, 100_000)])
def test_interval_of_a_share_is_that_of_scipy(tables: ReportTables, passed: int, count: int) -> None:
    low, high = tables.connection.execute(
        f"SELECT wilson_low({passed}, {count}), wilson_high({passed}, {count})"
    ).fetchall()[0]
    expected = binomtest(passed, count).proportion_ci(0.95, method="wilson")
    assert (low, high) == pytest.approx((expected.low, expected.high), abs=1e-9)


def test_share_of_nothing_has_no_interval(tables: ReportTables) -> None:
    assert tables.connection.execute("SELECT wilson_low(0, 0), wilson_high(0, 0)").fetchall() == [(None, None)]


def test_every_item_leaves_at_one_stage_and_meshes_enter_no_generation(
    tables: ReportTables, rows: dict[str, Rows]
) -> None:
    found = by(tables, stage_queries.SUCCESS_BY_STAGE, "stage")
    assert list(found) == list(REJECTION_REASONS)
    rejected = Counter(row["stage"] for row in rows["rejections"])
    assert {stage: row["rejected"] for stage, row in found.items()} == {stage: rejected[stage] for stage in found}
    left = len(rows["twins"]) + len(rows["rejections"])
    assert found["input"]["entered"] == left
    left -= rejected["input"]
    meshes = sum(row["kind"] == "mesh" for row in rows["twins"] + rows["rejections"] if row.get("stage") != "input")
    assert found["generate"]["entered"] == left - meshes
    for stage in list(found)[1:]:
        if stage != "generate":
            assert found[stage]["entered"] == left
        left -= rejected[stage]
    assert found["placement"]["passed"] == left == len(rows["twins"])


def test_reasons_add_up_to_all_rejections(tables: ReportTables, rows: dict[str, Rows]) -> None:
    found = tables.result(stage_queries.REJECTIONS_BY_REASON).rows
    counted = Counter((row["stage"], row["reason"]) for row in rows["rejections"])
    assert {(row["stage"], row["reason"]): row["items"] for row in found} == dict(counted)
    assert sum(row["share_of_rejected"] for row in found) == pytest.approx(1)


def test_grasps_per_object_are_numpys_quantiles(tables: ReportTables, rows: dict[str, Rows]) -> None:
    found = by(tables, grasp_queries.GRASPS_PER_OBJECT, "quantity")
    verified = np.array([row["verified"] for row in rows["twins"]], float)
    row = found["verified"]
    assert row["objects"] == len(verified) and row["total"] == verified.sum()
    assert [row[name] for name in ("mean", "median", "p10", "p90", "min", "max")] == pytest.approx(
        [verified.mean(), *np.quantile(verified, [0.5, 0.1, 0.9]), verified.min(), verified.max()]
    )


def test_rate_of_all_grasps_is_the_same_by_twin_and_by_grasp(tables: ReportTables, rows: dict[str, Rows]) -> None:
    pooled = by(tables, grasp_queries.VERIFICATION_RATE, "proposals")
    gripper = tables.result(grasp_queries.BY_GRIPPER).only
    assert pooled["filtered by points and diversity"]["rate"] == gripper["rate"]
    assert pooled["unfiltered sample"]["rate"] == pytest.approx(gripper["unfiltered_rate"])
    grasps = [grasp for grasp in rows["grasps"] if own(grasp)]
    assert gripper["simulated"] == len(grasps)
    assert gripper["rate"] == pytest.approx(np.mean([grasp["verified"] for grasp in grasps]))


def test_interval_of_the_pooled_rate_holds_what_resampling_objects_gives(
    tables: ReportTables, rows: dict[str, Rows]
) -> None:
    row = by(tables, grasp_queries.VERIFICATION_RATE, "proposals")["filtered by points and diversity"]
    tried, held = (np.array([twin[key] for twin in rows["twins"]], float) for key in ("simulated", "verified"))
    picks = np.random.default_rng(0).integers(0, len(tried), (4000, len(tried)))
    again = held[picks].sum(axis=1) / tried[picks].sum(axis=1)
    assert (row["low"], row["high"]) == pytest.approx(np.quantile(again, [0.025, 0.975]), abs=0.005)
    binomial = binomtest(int(held.sum()), int(tried.sum())).proportion_ci(0.95, method="wilson")
    assert row["high"] - row["low"] > 2 * (binomial.high - binomial.low), "grasps of one object are alike"


def test_outcomes_are_those_of_failed_grasps_without_the_controls(tables: ReportTables, rows: dict[str, Rows]) -> None:
    found = by(tables, grasp_queries.OUTCOMES, "outcome")
    failed = [grasp for grasp in rows["grasps"] if grasp["outcome"] != "held"]
    assert {k: row["filtered"] for k, row in found.items()} == dict(Counter(g["outcome"] for g in failed if own(g)))
    sample = Counter(g["outcome"] for g in failed if g["proposer"].endswith(":unfiltered"))
    assert {k: row["unfiltered_sample"] for k, row in found.items()} == dict(sample)


def test_grasps_go_to_the_type_of_their_own_twins_point(tables: ReportTables, rows: dict[str, Rows]) -> None:
    types = {
        (point["twin_id"], point["point_id"]): point["type"] for point in rows["points"] if point["role"] == "grasp"
    }
    counted = Counter(types[grasp["twin_id"], grasp["grasp_point_id"]] for grasp in rows["grasps"] if own(grasp))
    assert {k: row["simulated"] for k, row in by(tables, grasp_queries.BY_GRASP_TYPE, "type").items()} == dict(counted)


def test_kappa_is_that_of_the_table_of_controls(tables: ReportTables, rows: dict[str, Rows]) -> None:
    controls = [grasp for grasp in rows["grasps"] if grasp["proposer"].endswith(":jittered")]
    first = np.array([grasp["outcome"] == "held" for grasp in controls])
    second = np.array([grasp["holds_in_second_engine"] for grasp in controls])
    table = np.array([[np.sum((first == a) & (second == b)) for b in (False, True)] for a in (False, True)]) / len(
        first
    )
    by_chance = (table.sum(axis=0) * table.sum(axis=1)).sum()
    found = tables.result(grasp_queries.SECOND_ENGINE).only
    assert found["controls"] == len(controls)
    assert found["kappa"] == pytest.approx((np.trace(table) - by_chance) / (1 - by_chance))


def test_robust_share_is_of_twins_that_were_repeated(tables: ReportTables, rows: dict[str, Rows]) -> None:
    tried = [twin for twin in rows["twins"] if twin["robust"] is not None]
    assert 0 < len(tried) < len(rows["twins"])
    expected = sum(twin["robust"] for twin in tried) / sum(twin["verified"] for twin in tried)
    assert tables.result(grasp_queries.ROBUST).only["robust_share"] == pytest.approx(expected)


def test_histograms_count_every_object_in_its_step(tables: ReportTables, rows: dict[str, Rows]) -> None:
    sides = np.array([twin["longest_m"] for twin in rows["twins"]])
    found = tables.result(object_queries.SIZE_HISTOGRAM).rows
    for row in found:
        low, high = (10 ** ((row["step"] + more) / object_queries.SIZE_STEPS) for more in (0, 1))
        assert row["objects"] == np.sum((sides >= low * (1 - 1e-9)) & (sides < high * (1 - 1e-9)))
    assert sum(row["objects"] for row in found) == len(sides)


def test_values_on_an_edge_are_in_the_step_above_it() -> None:
    arrow = synthetic_tables(2, 0)
    twins = arrow["twins"]
    for name, values in (("longest_m", [0.1, 1.0]), ("mass_kg", [0.1, 1.0]), ("success_rate", [0.3, 1.0])):
        twins = twins.set_column(twins.column_names.index(name), name, pa.array(values))
    tables = ReportTables({**arrow, "twins": twins})
    assert [r["step"] for r in tables.result(object_queries.SIZE_HISTOGRAM).rows] == [-object_queries.SIZE_STEPS, 0]
    assert [r["step"] for r in tables.result(object_queries.MASS_HISTOGRAM).rows] == [-object_queries.MASS_STEPS, 0]
    assert [r["step"] for r in tables.result(grasp_queries.RATE_HISTOGRAM).rows] == [6, 19]


def test_terms_are_counted_once_a_twin_without_brackets_and_measurements(
    tables: ReportTables, rows: dict[str, Rows]
) -> None:
    words = {query.name: query for query in object_queries.WORDS}
    colors = by(tables, words["words_color"], "term")
    both = sum(twin["color"] == "dark grey (61 %), black (12 %)" for twin in rows["twins"])
    assert colors["dark grey"]["twins"] == colors["black"]["twins"] == both
    assert set(by(tables, words["words_size"], "term")) == {"palm-sized", "hand-sized", "medium-sized", "large"}


def test_share_inside_the_prior_is_that_of_the_package(tables: ReportTables, rows: dict[str, Rows]) -> None:
    found = by(tables, object_queries.mass_in_prior(object_queries.priors_of(["mug", "no such thing"])), "category")
    prior = load_priors()["mug"]
    masses = [twin["mass_kg"] for twin in rows["twins"] if twin["category"] == "mug"]
    inside = [prior.mass_kg.low <= mass <= prior.mass_kg.high for mass in masses]
    assert list(found) == ["mug"]
    assert found["mug"]["mass_inside"] == pytest.approx(np.mean(inside))


def test_cost_by_stage_adds_up_to_the_total(tables: ReportTables, rows: dict[str, Rows]) -> None:
    stages = by(tables, stage_queries.COST_BY_STAGE, "stage")
    total = by(tables, stage_queries.COST, "quantity")
    cpu = sum(row["cpu_seconds"] for row in rows["stages"])
    assert (
        total["CPU s"]["total"] == pytest.approx(cpu) == pytest.approx(sum(r["cpu_seconds"] for r in stages.values()))
    )
    assert total["CPU s"]["per_accepted"] == pytest.approx(cpu / len(rows["twins"]))
    assert list(stages) == [stage for stage in stage_queries.STAGE_ORDER if stage in stages], "in the pipeline's order"


def test_same_source_lists_accepted_and_rejected_together() -> None:
    arrow = synthetic_tables(3, 2)
    rejections = arrow["rejections"]
    source = arrow["twins"]["source_sha256"][0].as_py()
    sources = pa.array([source, "another"])
    arrow["rejections"] = rejections.set_column(
        rejections.column_names.index("source_sha256"), "source_sha256", sources
    )
    (row,) = ReportTables(arrow).result(stage_queries.SAME_SOURCE).rows
    ids = {arrow["twins"]["twin_id"][0].as_py(), arrow["rejections"]["twin_id"][0].as_py()}
    assert row["items"] == 2 and set(row["twin_ids"].split(", ")) == ids


def test_scatter_is_sampled_by_the_stated_seed() -> None:
    small = {
        row["twin_id"] for row in ReportTables(synthetic_tables(3000, 0)).result(object_queries.MASS_AND_SIZE).rows
    }
    assert len(small) == object_queries.SAMPLE
    expected = sorted(identities(3000, "twin"), key=_md5_with_seed)[: object_queries.SAMPLE]
    assert small == set(expected)


def _md5_with_seed(twin_id: str) -> str:
    return hashlib.md5(f"{twin_id}:{object_queries.SAMPLE_SEED}".encode()).hexdigest()
