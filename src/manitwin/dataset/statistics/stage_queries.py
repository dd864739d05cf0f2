"""Accepted and rejected: in all, by stage and by reason, by what was given, by configuration."""

from __future__ import annotations

from manitwin.dataset.statistics.query import Column, Query, text
from manitwin.twin.record import REJECTION_REASONS

STAGES = tuple(REJECTION_REASONS)
"""The stages that can reject, in their order: those of the record's schema."""

_ITEMS = """items AS (
  SELECT twin_id, kind, NULL AS stage, NULL AS reason FROM twins
  UNION ALL SELECT twin_id, kind, stage, reason FROM rejections)"""
_ORDER = ", ".join(f"({text(stage)}, {position})" for position, stage in enumerate(STAGES))

TOTALS = Query(
    "totals",
    "Items that ended, accepted or rejected.",
    """SELECT accepted, rejected, accepted + rejected AS items,
  accepted / nullif(accepted + rejected, 0) AS accepted_share,
  wilson_low(accepted, accepted + rejected) AS low, wilson_high(accepted, accepted + rejected) AS high
FROM (SELECT (SELECT count(*) FROM twins) AS accepted, (SELECT count(*) FROM rejections) AS rejected)""",
    (
        Column("items", "items"),
        Column("accepted", "accepted"),
        Column("rejected", "rejected"),
        Column("accepted_share", "accepted share [95 %]", "share", ("low", "high")),
    ),
    "An item that waits for a backend is neither, and is not here. Intervals of shares of items are Wilson's.",
)

SUCCESS_BY_STAGE = Query(
    "success_by_stage",
    "Success by stage, of the items that entered it.",
    f"""WITH stage_order(stage, position) AS (VALUES {_ORDER}),
{_ITEMS},
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
        Column("stage", "stage", "text"),
        Column("entered", "entered"),
        Column("passed", "passed"),
        Column("rejected", "rejected"),
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
        Column("stage", "stage", "text"),
        Column("reason", "reason", "text"),
        Column("items", "items"),
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
    (
        Column("kind", "source", "text"),
        Column("items", "items"),
        Column("accepted", "accepted"),
        Column("rejected", "rejected"),
        Column("accepted_share", "accepted share [95 %]", "share", ("low", "high")),
    ),
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
    (Column("check_name", "check not passed", "text"), Column("twins", "twins"), Column("share", "share", "share")),
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
    (
        Column("configuration", "configuration (sha256)", "text"),
        Column("seed", "seed"),
        Column("accepted", "accepted"),
        Column("rejected", "rejected"),
    ),
)

SAME_SOURCE = Query(
    "same_source",
    "Sources given more than once, byte for byte.",
    """SELECT source_sha256, count(*) AS items, string_agg(twin_id, ', ' ORDER BY twin_id) AS twin_ids
FROM (SELECT source_sha256, twin_id FROM twins UNION ALL SELECT source_sha256, twin_id FROM rejections)
GROUP BY source_sha256 HAVING count(*) > 1 ORDER BY items DESC, source_sha256""",
    (Column("items", "items"), Column("twin_ids", "twins", "text")),
    "The same bytes under another name, unit or up axis are another item.",
)
