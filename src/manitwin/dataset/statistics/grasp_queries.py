"""Grasp queries: grasps proposed, simulated and verified per object, failure modes, robustness and second-engine results."""

from __future__ import annotations

from manitwin.dataset.statistics.query import Column, Query, counts, histogram, labels, summary

GRASPS_PER_OBJECT = summary(
    "grasps_per_object",
    "Grasps of an accepted twin's own gripper.",
    {
        "proposed": "proposed",
        "simulated": "simulated",
        "verified": "verified",
        "approach octants": "approach_octants",
        "verification rate": "success_rate",
        "unfiltered rate": "unfiltered_success_rate",
    },
    heading="quantity per object",
    note="Proposed: grasps left by the gripper's own checks. Simulated: those near a chosen point, thinned for diversity (the "
    "paper's grasp candidates). Verified: held in simulation. Octants: directions of approach among the verified, of 8.",
)

VERIFICATION_RATE = Query(
    "verification_rate",
    "Verification rate over all grasps, with and without the filters.",
    """WITH tried AS (
  SELECT 1 AS position, 'filtered by points and diversity' AS proposals,
         simulated AS tried, verified AS held FROM twins
  UNION ALL
  SELECT 2, 'unfiltered sample', unfiltered_simulated,
         round(unfiltered_success_rate * unfiltered_simulated) FROM twins WHERE unfiltered_simulated > 0),
pooled AS (
  SELECT position, proposals, count(*) AS objects, sum(tried)::BIGINT AS tried, sum(held)::BIGINT AS held,
    sum(held) / nullif(sum(tried), 0) AS rate FROM tried GROUP BY ALL),
spread AS (
  SELECT position, any_value(rate) AS rate, 1.959963984540054 * sqrt(any_value(objects) / nullif(any_value(objects) - 1, 0)
    * fsum((t.held - rate * t.tried) ** 2)) / nullif(sum(t.tried), 0) AS half
  FROM tried t JOIN pooled p USING (position) GROUP BY position)
SELECT proposals, objects, tried, held, p.rate,
  CASE WHEN half >= 0 THEN greatest(p.rate - half, 0) END AS low,
  CASE WHEN half >= 0 THEN least(p.rate + half, 1) END AS high
FROM pooled p JOIN spread USING (position) ORDER BY position""",
    (
        *(*labels("proposals"), *counts("objects"), Column("tried", "simulated"), *counts("held")),
        Column("rate", "rate [95 %]", "share", ("low", "high")),
    ),
    "Grasps of one object are alike: the interval is that of a ratio with objects as clusters (the linearised variance; "
    "none for a single object). Objects of which no grasp held were rejected and are not counted here: see none_held above.",
)

BY_GRIPPER = Query(
    "by_gripper",
    "Grasps by gripper.",
    """SELECT gripper, count(DISTINCT twin_id) AS objects,
  count(DISTINCT twin_id) FILTER (own(proposer) AND verified) AS objects_held,
  count(*) FILTER (own(proposer)) AS simulated,
  count(*) FILTER (own(proposer) AND verified) AS verified,
  count(*) FILTER (own(proposer) AND verified) / count(DISTINCT twin_id) AS verified_per_object,
  count(*) FILTER (own(proposer) AND verified) / nullif(count(*) FILTER (own(proposer)), 0) AS rate,
  count(*) FILTER (unfiltered(proposer)) AS unfiltered_simulated,
  count(*) FILTER (unfiltered(proposer) AND outcome = 'held')
    / nullif(count(*) FILTER (unfiltered(proposer)), 0) AS unfiltered_rate,
  count(*) FILTER (own(proposer) AND verified AND retired) AS retired
FROM grasps GROUP BY gripper ORDER BY objects DESC, gripper""",
    (
        Column("gripper", "gripper", "text"),
        Column("objects", "objects"),
        Column("objects_held", "held"),
        Column("simulated", "grasps"),
        Column("verified", "verified"),
        Column("verified_per_object", "an object", "number"),
        Column("rate", "rate", "share"),
        Column("unfiltered_simulated", "unfiltered"),
        Column("unfiltered_rate", "unfiltered rate", "share"),
        Column("retired", "retired"),
    ),
    "Counted row by row in the table of grasps; a twin's own gripper is its first, the others are tried beside it. "
    "Held: objects with a verified grasp. An object: verified grasps per object tried.",
)

OUTCOMES = Query(
    "failed_outcomes",
    "How grasps fail.",
    """WITH failed AS (
  SELECT outcome, count(*) FILTER (own(proposer)) AS filtered, count(*) FILTER (unfiltered(proposer)) AS unfiltered_sample
  FROM grasps WHERE outcome <> 'held' AND NOT jittered(proposer) GROUP BY outcome)
SELECT outcome, filtered, filtered / nullif((SELECT sum(filtered) FROM failed), 0) AS filtered_share,
  unfiltered_sample, unfiltered_sample / nullif((SELECT sum(unfiltered_sample) FROM failed), 0) AS unfiltered_share
FROM failed ORDER BY filtered DESC, unfiltered_sample DESC, outcome""",
    (
        Column("outcome", "outcome", "text"),
        Column("filtered", "filtered"),
        Column("filtered_share", "of failed", "share"),
        Column("unfiltered_sample", "unfiltered sample"),
        Column("unfiltered_share", "of failed", "share"),
    ),
    "All grippers. Shares are of the failed grasps of the column.",
)

BY_GRASP_TYPE = Query(
    "by_grasp_type",
    "Grasps by the type of the grasp point that they serve.",
    """SELECT type, count(*) AS simulated, count(*) FILTER (verified) AS verified,
  count(*) FILTER (verified) / count(*) AS rate,
  (SELECT count(*) FROM points q WHERE q.role = 'grasp' AND q.type = p.type) AS points
FROM grasps g JOIN points p ON g.twin_id = p.twin_id AND g.grasp_point_id = p.point_id AND p.role = 'grasp'
WHERE own(proposer) GROUP BY type ORDER BY simulated DESC, type""",
    (
        *(*labels("type"), Column("points", "grasp points"), *counts("simulated", "verified")),
        Column("rate", "rate", "share"),
    ),
    "All grippers.",
)

ROBUST = Query(
    "robust",
    "Verified grasps repeated with perturbed pose, friction, force and mass.",
    """SELECT count(*) AS objects, sum(verified)::BIGINT AS verified, sum(robust)::BIGINT AS robust,
  sum(robust) / nullif(sum(verified), 0) AS robust_share, median(robustness_median) AS median_of_medians
FROM twins WHERE robust IS NOT NULL""",
    (
        *counts("objects", "verified", "robust"),
        Column("robust_share", "robust share", "share"),
        Column("median_of_medians", "median share held", "number"),
    ),
    "Robust: a sequential test says that it rather holds in the robust share of the cases than in the fragile one "
    "(both are in twin.json).",
)

SECOND_ENGINE = Query(
    "second_engine",
    "What a second engine says, by gripper.",
    """WITH tried AS (
  SELECT gripper, jittered(proposer) AS control, outcome = 'held' AS first, holds_in_second_engine AS second
  FROM grasps WHERE holds_in_second_engine IS NOT NULL AND NOT unfiltered(proposer)),
counted AS (
  SELECT gripper,
    count(*) FILTER (NOT control AND first) AS held_tried,
    count(*) FILTER (NOT control AND first AND second) AS held_hold,
    count(*) FILTER (NOT control AND NOT first) AS failed_tried,
    count(*) FILTER (NOT control AND NOT first AND second) AS failed_hold,
    count(*) FILTER (control) AS controls,
    avg((first = second)::INT) FILTER (control) AS observed,
    avg(first::INT) FILTER (control) AS p, avg(second::INT) FILTER (control) AS q
  FROM tried GROUP BY gripper)
SELECT gripper, held_tried, held_hold / nullif(held_tried, 0) AS holds_share,
  failed_tried, failed_hold / nullif(failed_tried, 0) AS failed_pass_share,
  controls, observed AS controls_agree,
  (observed - (p * q + (1 - p) * (1 - q))) / nullif(1 - (p * q + (1 - p) * (1 - q)), 0) AS kappa
FROM counted ORDER BY held_tried DESC, gripper""",
    (
        Column("gripper", "gripper", "text"),
        Column("held_tried", "held, tried again"),
        Column("holds_share", "hold there too", "share"),
        Column("failed_tried", "failed, tried again"),
        Column("failed_pass_share", "hold there", "share"),
        Column("controls", "jittered controls"),
        Column("controls_agree", "agree", "share"),
        Column("kappa", "Cohen's κ", "signed"),
    ),
    "κ is over the jittered controls alone, pooled over objects: among grasps that nearly all hold, agreement says little.",
)


def _per_object(column: str) -> Query:
    place, caption = f"({column} // 5) * 5 AS low", f"{column.capitalize()} grasps per object."
    return histogram(f"{column}_histogram", caption, place, f"{column} IS NOT NULL")


SIMULATED_HISTOGRAM, VERIFIED_HISTOGRAM = _per_object("simulated"), _per_object("verified")

RATE_HISTOGRAM = histogram(
    *("rate_histogram", "Verification rate of objects, in steps of 0.05."),
    *("least(floor(success_rate * 20 + 1e-9), 19)::INT AS step", "success_rate IS NOT NULL"),
)

ROBUSTNESS_HISTOGRAM = histogram(
    "robustness_histogram",
    "Share of perturbed trials in which a verified grasp holds, in steps of 0.1.",
    "least(floor(robustness * 10 + 1e-9), 9)::INT AS step",
    "robustness IS NOT NULL AND verified AND own(proposer)",
    rows="grasps",
    table="grasps",
)
