"""Stage queries: accepted and rejected items by stage, reason, source and configuration; time and cost by stage."""

from __future__ import annotations

from manitwin.dataset.index.conditions import sql_text
from manitwin.dataset.statistics.query import Column, Query, counts, labels
from manitwin.pipeline.stage_order import STAGE_ORDER
from manitwin.twin.record import REJECTION_REASONS

STAGES = tuple(REJECTION_REASONS)
"""The stages that can reject, in the order of the record's schema."""

_ITEM_COLUMNS = (
    *counts("items", "accepted", "rejected"),
    Column("accepted_share", "accepted share [95 %]", "share", ("low", "high")),
)
_ORDER = ", ".join(f"({sql_text(stage)}, {position})" for position, stage in enumerate(STAGES))

TOTALS = Query(
    "totals",
    "Items that ended, accepted or rejected.",
    """SELECT accepted, rejected, accepted + rejected AS items,
  accepted / nullif(accepted + rejected, 0) AS accepted_share,
  wilson_low(accepted, accepted + rejected) AS low, wilson_high(accepted, accepted + rejected) AS high
FROM (SELECT (SELECT count(*) FROM twins) AS accepted, (SELECT count(*) FROM rejections) AS rejected)""",
    _ITEM_COLUMNS,
    "An item that waits for a backend is neither, and is not here. Intervals of shares of items are Wilson's.",
)

SUCCESS_BY_STAGE = Query(
    "success_by_stage",
    "Success by stage, of the items that entered it.",
    f"""WITH stage_order(stage, position) AS (VALUES {_ORDER}),
items AS (
  SELECT twin_id, kind, NULL AS stage, NULL AS reason FROM twins
  UNION ALL SELECT twin_id, kind, stage, reason FROM rejections),
ended AS (
  SELECT kind, coalesce(position, {len(STAGES)}) AS position, count(*) AS items
  FROM items LEFT JOIN stage_order USING (stage) GROUP BY ALL),
counted AS (
  SELECT s.position, s.stage,
    coalesce(sum(items) FILTER (e.position >= s.position), 0)::BIGINT AS entered,
    coalesce(sum(items) FILTER (e.position > s.position), 0)::BIGINT AS passed
  FROM stage_order s LEFT JOIN ended e ON s.stage <> 'generate' OR e.kind <> 'mesh' GROUP BY ALL)
SELECT stage, entered, passed, entered - passed AS rejected, passed / nullif(entered, 0) AS passed_share,
  wilson_low(passed, entered) AS low, wilson_high(passed, entered) AS high
FROM counted ORDER BY position""",
    (
        *(*labels("stage"), *counts("entered", "passed", "rejected")),
        Column("passed_share", "passed share [95 %]", "share", ("low", "high")),
    ),
    "The stages are those that can reject. A mesh does not enter generate.",
)

REJECTIONS_BY_REASON = Query(
    "rejections_by_reason",
    "Rejected items by stage and reason.",
    f"""WITH stage_order(stage, position) AS (VALUES {_ORDER})
SELECT stage, reason, count(*) AS items,
  count(*) / (SELECT count(*) FROM rejections) AS share_of_rejected,
  count(*) / ((SELECT count(*) FROM rejections) + (SELECT count(*) FROM twins)) AS share_of_items
FROM rejections LEFT JOIN stage_order USING (stage)
GROUP BY stage, reason, position ORDER BY position, items DESC, reason""",
    (
        *(*labels("stage", "reason"), *counts("items")),
        Column("share_of_rejected", "of rejected", "share"),
        Column("share_of_items", "of all items", "share"),
    ),
)

SOURCES = Query(
    "sources",
    "Items by kind of source.",
    """WITH counted AS (
  SELECT kind, count(*) FILTER (accepted) AS accepted, count(*) AS items
  FROM (SELECT kind, true AS accepted FROM twins UNION ALL SELECT kind, false FROM rejections) GROUP BY kind)
SELECT kind, items, accepted, items - accepted AS rejected, accepted / items AS accepted_share,
  wilson_low(accepted, items) AS low, wilson_high(accepted, items) AS high
FROM counted ORDER BY items DESC, kind""",
    (Column("kind", "source", "text"), *_ITEM_COLUMNS),
)

LICENCES = Query(
    "licences",
    "Licences of the sources.",
    """SELECT license, count(*) FILTER (accepted) AS accepted, count(*) FILTER (NOT accepted) AS rejected,
  count(DISTINCT attribution) FILTER (accepted) AS credited
FROM (SELECT license, attribution, true AS accepted FROM twins
      UNION ALL SELECT license, NULL, false FROM rejections)
GROUP BY license ORDER BY accepted DESC, rejected DESC, license""",
    (
        Column("license", "licence", "text"),
        Column("accepted", "accepted twins"),
        Column("rejected", "rejected items"),
        Column("credited", "different credits"),
    ),
    "unknown: nobody said it. Such twins must not be published as they are.",
    shown=200,
)

FINDINGS = Query(
    "findings",
    "Findings of the quality checks in accepted twins.",
    """SELECT check_name, count(*) AS twins, count(*) / (SELECT count(*) FROM twins) AS share
FROM (SELECT unnest(failed_checks) AS check_name FROM twins)
GROUP BY check_name ORDER BY twins DESC, check_name""",
    (Column("check_name", "check not passed", "text"), *counts("twins"), Column("share", "share", "share")),
    "A finding is shown and can be filtered by; it does not reject.",
)

CONFIGURATIONS = Query(
    "configurations",
    "Configurations and seeds.",
    """SELECT left(config_sha256, 12) AS configuration, seed,
  count(*) FILTER (accepted) AS accepted, count(*) FILTER (NOT accepted) AS rejected
FROM (SELECT config_sha256, seed, true AS accepted FROM twins
      UNION ALL SELECT config_sha256, seed, false FROM rejections)
GROUP BY config_sha256, seed ORDER BY count(*) DESC, config_sha256, seed""",
    (Column("configuration", "configuration (sha256)", "text"), *counts("seed", "accepted", "rejected")),
)

SAME_SOURCE = Query(
    "same_source",
    "Sources given more than once, byte for byte.",
    """SELECT source_sha256, count(*) AS items, string_agg(twin_id, ', ' ORDER BY twin_id) AS twin_ids
FROM (SELECT source_sha256, twin_id FROM twins UNION ALL SELECT source_sha256, twin_id FROM rejections)
GROUP BY source_sha256 HAVING count(*) > 1 ORDER BY items DESC, source_sha256""",
    (*counts("items"), Column("twin_ids", "twins", "text")),
    "The same bytes under another name, unit or up axis are another item.",
)


_PLACE = f"list_position([{', '.join(map(sql_text, STAGE_ORDER))}], split_part(stage, '-', 1))"
"""Position of a stage in the pipeline; stages of further grippers (``verify-robotiq_2f85``) share that of the first gripper."""

COST_BY_STAGE = Query(
    "cost_by_stage",
    "Time and money by stage.",
    f"""SELECT stage, count(*) AS items, coalesce(fsum(cpu_seconds), 0) AS cpu_seconds,
  favg(cpu_seconds) AS cpu_mean, median(cpu_seconds) AS cpu_median, quantile_cont(cpu_seconds, 0.9) AS cpu_p90,
  fsum(cpu_seconds) / nullif((SELECT fsum(cpu_seconds) FROM stages), 0) AS cpu_share,
  coalesce(fsum(seconds), 0) AS seconds, coalesce(fsum(cost_usd), 0) AS cost_usd
FROM stages GROUP BY stage ORDER BY {_PLACE}, stage""",
    (
        *(*labels("stage"), *counts("items")),
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
        *labels("quantity"),
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
    (*labels("stage", "version", "backend"), Column("models", "different models"), *counts("items")),
)

PAPER_COLUMNS = (*labels("metric"), Column("here", "here", "number"), Column("paper", "paper", "given"))

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
    PAPER_COLUMNS,
    "Published figures: tables 3 and 4 and section 5.3 of the paper. Generation is of images and texts alone: through "
    "generation and the quality gate, of those that could be read. The two sets differ in objects, backends and trial: "
    "the figures stand beside each other, not against each other.",
)
