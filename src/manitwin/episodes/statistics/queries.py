"""Tables of the report: SQL (DuckDB) over the views ``attempts`` and ``joints``, with captions and notes."""

from __future__ import annotations

from manitwin.dataset.index.conditions import sql_text
from manitwin.dataset.statistics.query import PRELUDE as SHARES
from manitwin.dataset.statistics.query import Column, Query, counts, histogram, labels, summary
from manitwin.dataset.statistics.stage_queries import PAPER_COLUMNS
from manitwin.episodes.attempts import EXECUTION_FAILURES, OUTCOMES

SUCCEEDED = ("kept", "unplanned_contact", "disturbed")
MEANINGS = {
    "kept": "placed where it should be, nothing touched by accident: recorded",
    "unplanned_contact": "placed, but the robot touched what it should not",
    "disturbed": "placed, but another object was moved",
    "misplaced": "released too far from the goal",
    "toppled": "released, but tilted or fell",
    "dropped": "lost on the way",
    "not_lifted": "left behind on the table",
    "replan_failed": "no way to put it down from how it lay in the hand",
    "goal_missed": "it is not where, or not done, what the skill's goal asks for",
    "unsettled": "the start did not stand still",
    "reached_already": "the skill's goal was true before anything moved",
    "no_grasp": "the object has no verified grasp for this hand",
    "no_plan": "no grasp could be planned",
    "no_room": "the scene could not be set up",
}


def _among(outcomes: tuple[str, ...]) -> str:
    return f"outcome IN ({', '.join(map(sql_text, outcomes))})"


PRELUDE = f"""{SHARES}-- attempts by how far they came
CREATE OR REPLACE TEMP MACRO executed(outcome) AS {_among((*SUCCEEDED, *EXECUTION_FAILURES))};
CREATE OR REPLACE TEMP MACRO succeeded(outcome) AS {_among(SUCCEEDED)};
CREATE OR REPLACE TEMP MACRO kept(outcome) AS outcome = 'kept';
"""

_COUNTS = """count(*) AS attempted, count(*) FILTER (executed(outcome)) AS executed,
  count(*) FILTER (succeeded(outcome)) AS succeeded, count(*) FILTER (kept(outcome)) AS kept"""
_RATES = """executed / nullif(attempted, 0) AS planned_share, succeeded / nullif(executed, 0) AS rate,
  wilson_low(succeeded, executed) AS low, wilson_high(succeeded, executed) AS high, kept / nullif(attempted, 0) AS kept_share"""
_RATE_COLUMNS = (
    *counts("attempted", "executed"),
    Column("planned_share", "of attempted", "share"),
    Column("succeeded", "succeeded"),
    Column("rate", "of executed [95 %]", "share", ("low", "high")),
    Column("kept", "kept"),
    Column("kept_share", "of attempted", "share"),
)


_CATEGORY = "coalesce(nullif(category, ''), 'not told')"
"""Attempts that could not be set up have no category."""


def _by(
    name: str,
    caption: str,
    keys: str,
    columns: tuple[Column, ...],
    order: str,
    *,
    named: str = "*",
    note: str = "",
    where: str = "",
) -> Query:
    sql = (
        f"SELECT {named}, {_RATES} FROM (SELECT {keys}, {_COUNTS} FROM attempts {where} GROUP BY ALL) ORDER BY {order}"
    )
    return Query(name, caption, sql, (*columns, *_RATE_COLUMNS), note)


FUNNEL = Query(
    "funnel",
    "How far attempts came.",
    f"""WITH counted AS (SELECT {_COUNTS},
  count(*) FILTER (outcome NOT IN ('unsettled', 'reached_already', 'no_room')) AS started FROM attempts)
SELECT step, attempts, attempts / nullif(first, 0) AS of_all, attempts / nullif(before, 0) AS of_before,
  wilson_low(attempts, before) AS low, wilson_high(attempts, before) AS high
FROM (SELECT unnest(['attempted', 'set up and standing', 'planned and executed', 'succeeded', 'kept']) AS step,
        unnest([attempted, started, executed, succeeded, kept]) AS attempts, attempted AS first,
        unnest([NULL, attempted, started, executed, succeeded]) AS before FROM counted)""",
    (
        *(*labels("step"), *counts("attempts")),
        Column("of_all", "of all", "share"),
        Column("of_before", "of the step before [95 %]", "share", ("low", "high")),
    ),
    "Intervals are Wilson's, as if attempts were independent; those with one object are alike, so they are a little narrow.",
)

_MEANINGS = ", ".join(f"({sql_text(name)}, {place}, {sql_text(MEANINGS[name])})" for place, name in enumerate(OUTCOMES))
OUTCOMES_COUNTED = Query(
    "outcomes",
    "What became of the attempts.",
    f"""SELECT o.outcome, meaning, count(a.outcome) AS attempts,
  count(a.outcome) / nullif((SELECT count(*) FROM attempts), 0) AS share
FROM (VALUES {_MEANINGS}) AS o(outcome, position, meaning) LEFT JOIN attempts a ON a.outcome = o.outcome
GROUP BY o.outcome, position, meaning ORDER BY position""",
    (
        Column("outcome", "outcome", "text"),
        Column("meaning", "", "text"),
        Column("attempts", "attempts"),
        Column("share", "of all", "share"),
    ),
)

PLAN_FAILURES = Query(
    "plan_failures",
    "Why candidate grasps could not be planned.",
    """WITH failed AS (
  SELECT reason, (plan_failures ->> ('$."' || reason || '"'))::INT AS grasps, outcome
  FROM (SELECT unnest(json_keys(plan_failures)) AS reason, plan_failures, outcome FROM attempts))
SELECT reason, sum(grasps)::BIGINT AS grasps, sum(grasps) / (SELECT sum(grasps) FROM failed) AS share,
  count(*) AS attempts, count(*) FILTER (outcome = 'no_plan') AS without_plan
FROM failed GROUP BY reason ORDER BY grasps DESC, reason""",
    (
        Column("reason", "reason", "text"),
        Column("grasps", "candidate grasps"),
        Column("share", "of the failed", "share"),
        Column("attempts", "attempts that met it"),
        Column("without_plan", "of these without any plan"),
    ),
    "Several candidates of one attempt may fail before one can be planned.",
)

BY_SKILL = _by("by_skill", "Success by skill.", "skill", labels("skill"), "attempted DESC, skill")
BY_CATEGORY = _by(
    *("by_category", "Success by category.", f"{_CATEGORY} AS category, count(DISTINCT twin_id) AS objects"),
    (*labels("category"), *counts("objects")),
    "attempted DESC, category",
)
BY_OBJECT = _by(
    *("by_object", "Success by object, the worst first.", "twin_id, max(category) AS category"),
    (Column("twin_id", "twin", "text"), *labels("category")),
    "kept_share, attempted DESC, twin_id",
    where="WHERE twin_id <> ''",
)
BY_GRASP_TYPE = _by(
    *("by_grasp_type", "Success by the type of the grasp that was used.", "coalesce(grasp_type, 'none') AS grasp_type"),
    (Column("grasp_type", "grasp type", "text"),),
    "attempted DESC, grasp_type",
    note="Only attempts that found a plan have a grasp.",
    where="WHERE executed(outcome)",
)
BY_ROBOT = _by(
    *("by_robot", "Success by robot, with its own grasps and with those of another gripper.", "robot, transferred"),
    (*labels("robot"), Column("grasps_of", "grasps", "text")),
    "robot, transferred",
    named="*, CASE WHEN transferred THEN 'transferred' ELSE 'own' END AS grasps_of",
)
BY_OTHERS = _by(
    *("by_others", "Success by the number of other objects.", "others"),
    (Column("others", "other objects"),),
    "others",
)

NEVER_KEPT = Query(
    "never_kept",
    "Objects without a kept episode.",
    f"""SELECT twin_id, category, attempted, executed, succeeded,
  (SELECT string_agg(outcome || ' ' || n, ', ' ORDER BY n DESC, outcome)
    FROM (SELECT outcome, count(*) AS n FROM attempts b WHERE b.twin_id = a.twin_id GROUP BY outcome)) AS outcomes
FROM (SELECT twin_id, max(category) AS category, {_COUNTS} FROM attempts WHERE twin_id <> '' GROUP BY twin_id) a
WHERE kept = 0 ORDER BY attempted DESC, twin_id""",
    (
        *(Column("twin_id", "twin", "text"), *labels("category"), *counts("attempted", "executed", "succeeded")),
        Column("outcomes", "what became of them", "text"),
    ),
    "A share over all attempts hides them: none of their episodes is in the data.",
    shown=1000,
)

LENGTHS = summary(
    "lengths",
    "Lengths of kept episodes.",
    {"length, s": "length_s", "frames": "length_s * 20"},
    table="(SELECT * FROM attempts WHERE kept(outcome))",
    rows="episodes",
    total=True,
)
LENGTH_STEP_S = 0.5
LENGTH_HISTOGRAM = histogram(
    "length_histogram",
    f"Lengths of kept episodes in steps of {LENGTH_STEP_S} s.",
    f"floor(length_s / {LENGTH_STEP_S} + 1e-9)::INT AS step",
    "kept(outcome) AND length_s IS NOT NULL",
    rows="episodes",
    table="attempts",
)

PLACEMENT = summary(
    "placement",
    "How well objects are placed.",
    {
        "position error, mm": "position_error_m * 1000",
        "tilt, degrees": "degrees(tilt_rad)",
        "yaw error, degrees": "degrees(yaw_error_rad)",
        "slip in the hand, mm": "slip_m * 1000",
    },
    table="(SELECT * FROM attempts WHERE succeeded(outcome))",
    rows="episodes",
    heading="error",
    note="Of all that succeeded, of the object at rest after its release, against the goal that was asked for.",
)
PLACEMENT_HISTOGRAM = histogram(
    "placement_histogram",
    "Position errors of what succeeded, in steps of 1 mm; the last one is 20 mm and more.",
    "least(floor(position_error_m * 1000 + 1e-9), 20)::INT AS step",
    "succeeded(outcome) AND position_error_m IS NOT NULL",
    rows="episodes",
    table="attempts",
)

FAILED_GRASPS = Query(
    "failed_grasps",
    "Verified grasps that failed when they were executed.",
    """SELECT twin_id, category, grasp_id, robot, count(*) AS executed, count(*) FILTER (NOT succeeded(outcome)) AS failed,
  count(*) FILTER (NOT succeeded(outcome)) / count(*) AS share,
  string_agg(DISTINCT outcome, ', ' ORDER BY outcome) FILTER (NOT succeeded(outcome)) AS outcomes
FROM attempts WHERE executed(outcome) AND grasp_id IS NOT NULL GROUP BY twin_id, category, grasp_id, robot
HAVING failed > 0 ORDER BY failed DESC, share DESC, twin_id, grasp_id, robot""",
    (
        *(Column("twin_id", "twin", "text"), *labels("category"), Column("grasp_id", "grasp", "text")),
        *(*labels("robot"), *counts("executed", "failed")),
        Column("share", "share", "share"),
        Column("outcomes", "how", "text"),
    ),
    "These are what can be retired: the trial of a hand in free space saw neither table nor long ways.",
)
GRASPS = Query(
    "grasps",
    "Grasps that were executed.",
    """SELECT robot, count(*) AS grasps, sum(executed)::BIGINT AS executed, count(*) FILTER (failed = 0) AS always,
  count(*) FILTER (failed > 0 AND failed < executed) AS sometimes, count(*) FILTER (failed = executed) AS never
FROM (SELECT robot, twin_id, grasp_id, count(*) AS executed, count(*) FILTER (NOT succeeded(outcome)) AS failed
      FROM attempts WHERE executed(outcome) AND grasp_id IS NOT NULL GROUP BY ALL)
GROUP BY robot ORDER BY robot""",
    (
        Column("robot", "robot", "text"),
        Column("grasps", "different grasps"),
        Column("executed", "executions"),
        Column("always", "never failed"),
        Column("sometimes", "failed sometimes"),
        Column("never", "failed always"),
    ),
)

JOINTS = Query(
    "joints",
    "Joint positions and speeds of kept episodes, against the limits of the robot.",
    "SELECT * FROM joints ORDER BY robot, position",
    (
        *labels("robot", "joint"),
        Column("lowest_rad", "lowest, rad", "signed"),
        Column("highest_rad", "highest", "signed"),
        Column("lower_rad", "lower limit", "signed"),
        Column("upper_rad", "upper limit", "signed"),
        Column("used", "of the range", "share"),
        Column("fastest_rad_s", "fastest, rad/s", "number"),
        Column("limit_rad_s", "limit", "number"),
    ),
    "Positions are measured, not commanded; speeds are those of the planned limits, which may be below the URDF's.",
)

BESIDE_THE_PAPER = Query(
    "beside_the_paper",
    "These episodes beside the paper's table of data generation.",
    """SELECT metric, here, paper::DOUBLE AS paper, comparable FROM (
  SELECT 1 AS position, 'objects' AS metric, count(DISTINCT nullif(twin_id, ''))::DOUBLE AS here, 100000.0 AS paper,
    'objects that were attempted; the paper counts its whole set' AS comparable FROM attempts
  UNION ALL SELECT 2, 'objects with a kept episode', count(DISTINCT twin_id)::DOUBLE, NULL, 'the paper does not say'
    FROM attempts WHERE kept(outcome)
  UNION ALL SELECT 3, 'grasp trajectories', count(*)::DOUBLE, 1e7,
    'kept episodes; the paper does not say how many were attempted, nor whether objects are put down again'
    FROM attempts WHERE kept(outcome)
  UNION ALL SELECT 4, 'mean length, s', favg(length_s), 7.6,
    'set by the limits of speed and acceleration that the planner is given, which the paper does not say'
    FROM attempts WHERE kept(outcome)
  UNION ALL SELECT 5, 'verified grasps', NULL, 5e6, 'a number of the set of twins: manitwin stats DATASET'
  UNION ALL SELECT 6, 'different grasps executed', count(*)::DOUBLE, NULL, 'the paper does not say'
    FROM (SELECT DISTINCT twin_id, grasp_id FROM attempts WHERE executed(outcome))
  UNION ALL SELECT 7, 'robots', count(DISTINCT robot)::DOUBLE, NULL, 'the paper shows several, without numbers'
    FROM attempts
  UNION ALL SELECT 8, 'success of executed, %', 100 * count(*) FILTER (succeeded(outcome))
      / nullif(count(*) FILTER (executed(outcome)), 0), NULL, 'the paper does not say' FROM attempts)
ORDER BY position""",
    (*PAPER_COLUMNS, Column("comparable", "what is compared", "text")),
    "Published figures: the paper's table of data generation statistics.",
)

QUERIES: tuple[Query, ...] = (
    *(FUNNEL, OUTCOMES_COUNTED, PLAN_FAILURES, BESIDE_THE_PAPER),
    *(BY_SKILL, BY_ROBOT, BY_CATEGORY, BY_OBJECT, NEVER_KEPT, BY_GRASP_TYPE, BY_OTHERS),
    *(LENGTHS, LENGTH_HISTOGRAM, PLACEMENT, PLACEMENT_HISTOGRAM, JOINTS, GRASPS, FAILED_GRASPS),
)
