"""``manitwin evaluate generation``: success rate of inputs, causes of rejection, and similarity of twins to their inputs."""

from __future__ import annotations

from collections.abc import Callable

from manitwin.dataset.evaluation import paper_figures
from manitwin.dataset.evaluation.input_likeness import Likeness, Models, likeness_of_twins
from manitwin.dataset.evaluation.quality_table import quality_rows, sample_pictures, twin_rows
from manitwin.dataset.evaluation.tables import EvaluationReport, EvaluationTable
from manitwin.dataset.statistics.grasp_queries import VERIFICATION_RATE
from manitwin.dataset.statistics.object_queries import CATEGORIES, DIMENSIONS
from manitwin.dataset.statistics.query import Query, ReportTables, Row
from manitwin.dataset.statistics.stage_queries import REJECTIONS_BY_REASON, SOURCES, SUCCESS_BY_STAGE
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import Twin

_TWINS = Query(
    "twins",
    "",
    """SELECT count(*) AS objects, avg(simulated) AS simulated, avg(verified) AS verified,
  coalesce(sum(verified), 0)::DOUBLE AS total, count(DISTINCT category) AS categories,
  min(longest_m) AS smallest_m, max(longest_m) AS largest_m FROM twins""",
)
_SUCCESS = Query(
    "success",
    "",
    """WITH said AS (SELECT kind, NULL AS stage FROM twins UNION ALL SELECT kind, stage FROM rejections),
counted AS (
  SELECT count(*) FILTER (stage IS NULL OR stage <> 'input') AS entered,
    count(*) FILTER (stage IS NULL OR stage NOT IN ('input', 'generate', 'gate')) AS passed
  FROM said WHERE kind <> 'mesh')
SELECT entered, passed, passed / nullif(entered, 0) AS share, wilson_low(passed, entered) AS low,
  wilson_high(passed, entered) AS high FROM counted""",
)
_SECONDS = Query(
    "seconds",
    "",
    """SELECT CASE WHEN kind = 'text' THEN 'text' ELSE 'image' END AS input, avg(s.seconds) AS seconds, count(*) AS objects
FROM stages s JOIN twins t USING (twin_id) WHERE s.stage = 'generate' AND kind <> 'mesh' GROUP BY input ORDER BY input""",
)
_SIZES = Query(
    "sizes",
    "Longest sides of the twins, in steps of 5 cm.",
    """SELECT (5 * floor(longest_m * 20))::INT AS from_cm, count(*) AS twins FROM twins GROUP BY 1 ORDER BY 1""",
    note="The paper's figure 6 shows 5-50 cm, its text says 2 cm to 37 cm.",
)


def evaluate_generation(
    dataset: str, models: Models, *, seed: int = 0, on_twin: Callable[[str], None] = lambda twin_id: None
) -> EvaluationReport:
    """Return the tables on a data set's generation, from its index and from views of its accepted twins.

    ``models`` compute similarity in addition to the built-in measures; metrics of a missing model are None and shown as not
    measured. ``on_twin`` is called for each compared twin. Raises UsageError for a data set without an index, at a URL, or empty.
    """
    root = DatasetRoot(dataset)
    if root.local is None:
        raise UsageError(f"{dataset}: is at a URL; copy the data set to this machine, since its twins are rendered")
    tables = ReportTables.of_index(root)
    sources = tables.result(SOURCES)
    if not sources.rows:
        raise UsageError(f"{dataset}: no input was accepted or rejected yet; build some, or give another data set")
    folders = [root.local / root.twin_name(twin_id) for twin_id in root.twin_ids()]
    twins = (twin for folder in folders if (twin := Twin(folder)).record.status == "accepted")
    found = likeness_of_twins(twins, models, seed=seed, on_twin=on_twin)
    results = {
        query.name: tables.result(query)
        for query in (SUCCESS_BY_STAGE, REJECTIONS_BY_REASON, CATEGORIES, DIMENSIONS, _SIZES)
    }
    shown = [
        EvaluationTable(
            "generation_quality",
            "Likeness to the input (table 2 of the paper beside).",
            quality_rows(found, tables.result(_SECONDS).rows),
            "Means over twins of means over 30 views. Shuffled: the same twins against another twin's input; matched higher: "
            "the share of twins that are more like their own, with Wilson's 95 % interval.",
        ),
        EvaluationTable(
            "beside_the_paper",
            "Beside the paper (table 4, section 5.3).",
            _comparison_rows(tables),
            "The paper gives no intervals.",
        ),
        EvaluationTable.of(sources),
        *(EvaluationTable.of(each) for each in results.values()),
        EvaluationTable("twins", "Likeness of each twin.", twin_rows(found), printed=False),
    ]
    return EvaluationReport(
        "Generation", _lead(dataset, sources.rows, found), shown, models.describe_models(), sample_pictures(found)
    )


def _comparison_rows(tables: ReportTables) -> list[Row]:
    twins, success = tables.result(_TWINS).only, tables.result(_SUCCESS).only
    count = twins["objects"]
    rows = [
        paper_figures.comparison_row(
            *("3D generation success rate", success["share"], paper_figures.GENERATION_SUCCESS, "in part"),
            "images and texts that could be read, through generation and the quality gate; there the gate asks a VLM, here "
            "what the build named; other inputs, and templates of texts cannot fail as a generator does",
            interval=(success["low"], success["high"]),
            objects=success["entered"],
        ),
        *paper_figures.grasp_rows(twins, tables.result(VERIFICATION_RATE).rows),
    ]
    size = "inputs differ; the paper's own figure shows 5 to 50 cm"
    return [
        *rows,
        paper_figures.comparison_row("objects", count, paper_figures.OBJECTS, "no", "a matter of what was built"),
        paper_figures.comparison_row(
            "categories", twins["categories"], paper_figures.CATEGORIES, "no", "a matter of what was built"
        ),
        paper_figures.comparison_row(
            "smallest longest side, m", twins["smallest_m"], paper_figures.SMALLEST_M, "in part", size, objects=count
        ),
        paper_figures.comparison_row(
            "largest longest side, m", twins["largest_m"], paper_figures.LARGEST_M, "in part", size, objects=count
        ),
    ]


def _lead(dataset: str, sources: list[Row], found: list[Likeness]) -> list[str]:
    accepted, items = sum(row["accepted"] for row in sources), sum(row["items"] for row in sources)
    images = sum(each.source.kind == "image" for each in found)
    lines = [
        f"{dataset}: {accepted:,} of {items:,} inputs became twins; {images:,} of an image and {len(found) - images:,} of a text"
        " are compared with it, meshes with nothing"
    ]
    left = [each for each in found if each.source.left_out]
    return [*lines, *(f"left out of the comparison: {each.twin_id}: {each.source.left_out}" for each in left)]
