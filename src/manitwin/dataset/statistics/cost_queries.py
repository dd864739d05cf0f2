"""What it took: time and money by stage, per accepted twin and in all."""

from __future__ import annotations

from manitwin.dataset.statistics.query import Column, Query, text
from manitwin.engine.stage_order import STAGE_ORDER

_PLACE = f"list_position([{', '.join(map(text, STAGE_ORDER))}], split_part(stage, '-', 1))"
"""A stage's place in the pipeline; the stages of further grippers (``verify-robotiq_2f85``) stand by the first one's."""

COST_BY_STAGE = Query(
    "cost_by_stage",
    "Time and money by stage.",
    f"""SELECT stage, count(*) AS items, coalesce(fsum(cpu_seconds), 0) AS cpu_seconds,
  favg(cpu_seconds) AS cpu_mean, median(cpu_seconds) AS cpu_median, quantile_cont(cpu_seconds, 0.9) AS cpu_p90,
  fsum(cpu_seconds) / nullif((SELECT fsum(cpu_seconds) FROM stages), 0) AS cpu_share,
  coalesce(fsum(seconds), 0) AS seconds, coalesce(fsum(cost_usd), 0) AS cost_usd
FROM stages GROUP BY stage ORDER BY {_PLACE}, stage""",
    (
        Column("stage", "stage", "text"),
        Column("items", "items"),
        Column("cpu_mean", "mean CPU s", "number"),
        Column("cpu_median", "median", "number"),
        Column("cpu_p90", "p90", "number"),
        Column("cpu_share", "of all CPU time", "share"),
        Column("cpu_seconds", "total CPU s", "number"),
        Column("seconds", "total wall s", "number"),
        Column("cost_usd", "total USD", "usd"),
    ),
    "Wall time depends on what else the machine did; CPU time of a stage's own process is what it took. A stage that "
    "rejects records no time of its own.",
)

COST = Query(
    "cost",
    "Time and money in all and per accepted twin.",
    """SELECT quantity, total, total / nullif(items, 0) AS per_item, total / nullif(accepted, 0) AS per_accepted
FROM (SELECT unnest(['CPU s', 'wall s', 'USD']) AS quantity,
        unnest([coalesce(fsum(cpu_seconds), 0), coalesce(fsum(seconds), 0), coalesce(fsum(cost_usd), 0)]) AS total,
        (SELECT count(*) FROM twins) AS accepted,
        (SELECT count(*) FROM twins) + (SELECT count(*) FROM rejections) AS items
      FROM stages)""",
    (
        Column("quantity", "quantity", "text"),
        Column("total", "total", "number"),
        Column("per_item", "per item", "number"),
        Column("per_accepted", "per accepted twin", "number"),
    ),
    "Per accepted twin: with what its rejected companions took.",
)

BACKENDS = Query(
    "backends",
    "Code and backends of the stages.",
    f"""SELECT stage, version, backend, count(DISTINCT model) AS models, count(*) AS items
FROM stages GROUP BY stage, version, backend ORDER BY {_PLACE}, stage, version, backend""",
    (
        Column("stage", "stage", "text"),
        Column("version", "version", "text"),
        Column("backend", "backend", "text"),
        Column("models", "different models"),
        Column("items", "items"),
    ),
)

BESIDE_THE_PAPER = Query(
    "beside_the_paper",
    "This data set beside ManiTwin-100K.",
    """WITH generation AS (
  SELECT count(*) FILTER (stage IS NULL OR stage NOT IN ('input')) AS entered,
    count(*) FILTER (stage IS NULL OR stage NOT IN ('input', 'generate', 'gate')) AS passed
  FROM (SELECT kind, NULL AS stage FROM twins UNION ALL SELECT kind, stage FROM rejections) WHERE kind <> 'mesh')
SELECT metric, here, paper::DOUBLE AS paper FROM (
  SELECT 1 AS position, 'objects' AS metric, count(*)::DOUBLE AS here, 100000.0 AS paper FROM twins
  UNION ALL SELECT 2, '3D generation success rate, %', 100 * passed / nullif(entered, 0), 69.67 FROM generation
  UNION ALL SELECT 3, 'grasp candidates per object', avg(simulated), 81.63 FROM twins
  UNION ALL SELECT 4, 'verified grasps per object', avg(verified), 62.14 FROM twins
  UNION ALL SELECT 5, 'grasp verification success rate, %', 100 * sum(verified) / nullif(sum(simulated), 0), 76.13
    FROM twins
  UNION ALL SELECT 6, 'verified grasps in all', coalesce(sum(verified), 0)::DOUBLE, 5e6 FROM twins
  UNION ALL SELECT 7, 'categories', count(DISTINCT category)::DOUBLE, 512.0 FROM twins
  UNION ALL SELECT 8, 'smallest longest side, m', min(longest_m), 0.02 FROM twins
  UNION ALL SELECT 9, 'largest longest side, m', max(longest_m), 0.37 FROM twins)
ORDER BY position""",
    (
        Column("metric", "metric", "text"),
        Column("here", "here", "number"),
        Column("paper", "paper", "given"),
    ),
    "Published figures: tables 3 and 4 and section 5.3 of the paper. Generation is of images and texts alone: through "
    "generation and the quality gate, of those that could be read. The two sets differ in objects, backends and trial: "
    "the figures stand beside each other, not against each other.",
)
