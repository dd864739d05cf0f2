"""``manitwin evaluate grasps``: success rates and diversity of grasps, repeated trials, and results in a second engine."""

from __future__ import annotations

from manitwin.dataset.evaluation.paper_figures import grasp_rows
from manitwin.dataset.evaluation.tables import EvaluationReport, EvaluationTable
from manitwin.dataset.statistics.grasp_queries import GRASPS_PER_OBJECT, OUTCOMES, SECOND_ENGINE, VERIFICATION_RATE
from manitwin.dataset.statistics.query import Query, ReportTables
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot

_OCTANT = """(2 * (q[2] * q[4] + q[1] * q[3]) >= 0)::INT + 2 * (2 * (q[3] * q[4] - q[1] * q[2]) >= 0)::INT
    + 4 * (1 - 2 * (q[2] * q[2] + q[3] * q[3]) >= 0)::INT"""
"""Octant of the approach direction, the third column of the rotation of a wxyz quaternion (geometry.grasp_diversity)."""


def _grasp_query(name: str, key: str, caption: str) -> Query:
    """Return the query of grasps by a column: filtered grasps, unfiltered sample, octants, repeated trials, second engine."""
    return Query(
        name,
        caption,
        f"""WITH said AS (
  SELECT *, quaternion_wxyz AS q FROM grasps WHERE NOT jittered(proposer)),
octants AS (
  SELECT {key}, twin_id, gripper, count(DISTINCT {_OCTANT}) AS octants
  FROM said WHERE own(proposer) AND verified GROUP BY ALL),
spread AS (SELECT {key}, avg(octants) AS octants, avg((octants >= 4)::INT) AS of_four FROM octants GROUP BY {key}),
counted AS (
  SELECT {key}, count(DISTINCT twin_id) AS objects,
    count(*) FILTER (own(proposer)) AS simulated,
    count(*) FILTER (own(proposer) AND verified) AS verified,
    count(*) FILTER (unfiltered(proposer)) AS unfiltered,
    count(*) FILTER (unfiltered(proposer) AND outcome = 'held') AS unfiltered_held,
    count(*) FILTER (own(proposer) AND verified AND robustness IS NOT NULL) AS repeated,
    avg(robustness) FILTER (own(proposer) AND verified) AS robustness_mean,
    count(*) FILTER (own(proposer) AND outcome = 'held' AND holds_in_second_engine IS NOT NULL) AS second_tried,
    count(*) FILTER (own(proposer) AND outcome = 'held' AND holds_in_second_engine) AS second_holds
  FROM said GROUP BY {key})
SELECT c.{key}, objects, simulated, verified, verified / nullif(objects, 0) AS verified_per_object,
  verified / nullif(simulated, 0) AS held_share,
  unfiltered, unfiltered_held / nullif(unfiltered, 0) AS unfiltered_held_share,
  s.octants AS octants_mean, s.of_four AS objects_of_four_octants,
  repeated, robustness_mean, second_tried, second_holds / nullif(second_tried, 0) AS second_holds_share
FROM counted c LEFT JOIN spread s ON s.{key} IS NOT DISTINCT FROM c.{key}
ORDER BY objects DESC, c.{key}""",
        note="Octants: directions of approach of the verified grasps of an object, of 8. Robustness: the mean share of "
        "perturbed trials in which a verified grasp holds. Second: of the held ones that were tried in the second engine. Grasps "
        "of one object are alike: the interval above takes objects as clusters; of few objects there is none to tell.",
    )


BY_GRIPPER = _grasp_query("grasps_by_gripper", "gripper", "Grasps by gripper.")
BY_CATEGORY = _grasp_query("grasps_by_category", "category", "Grasps by category.")
_TWINS = Query(
    "twins",
    "",
    """SELECT count(*) AS objects, avg(simulated) AS simulated, avg(verified) AS verified,
  coalesce(sum(verified), 0)::DOUBLE AS total FROM twins""",
)


def evaluate_grasps(dataset: str) -> EvaluationReport:
    """Return the tables on a data set's grasps, from its index alone.

    Raises UsageError for a data set without an index, or without accepted twins.
    """
    tables = ReportTables.of_index(DatasetRoot(dataset))
    twins = tables.result(_TWINS).only
    if not twins["objects"]:
        raise UsageError(f"{dataset}: has no accepted twin; build twins, or give another data set")
    results = {
        query.name: tables.result(query)
        for query in (VERIFICATION_RATE, GRASPS_PER_OBJECT, BY_GRIPPER, BY_CATEGORY, OUTCOMES, SECOND_ENGINE)
    }
    rate = results["verification_rate"].rows
    beside = EvaluationTable(
        "beside_the_paper",
        "Beside the paper.",
        grasp_rows(twins, rate),
        "Published figures: tables 3 and 4 of the paper, which gives no intervals.",
    )
    lead = [
        f"{dataset}: {twins['objects']:,} accepted twins, {twins['total']:,.0f} verified grasps of their first grippers"
    ]
    return EvaluationReport("Grasps", lead, [beside, *(EvaluationTable.of(each) for each in results.values())], {})
