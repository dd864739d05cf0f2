"""Report of a data set: run the queries, draw the figures, and arrange both in sections."""

from __future__ import annotations

import tempfile
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path, PurePosixPath

from manitwin.dataset.index.near_duplicates import MAX_SHAPE_DISTANCE, MAX_SIZE_RATIO, NearDuplicates, near_duplicates
from manitwin.dataset.index.query import Index
from manitwin.dataset.statistics import grasp_queries as grasps
from manitwin.dataset.statistics import object_queries as objects
from manitwin.dataset.statistics import stage_queries as stages
from manitwin.dataset.statistics.figures import bars, histograms, masses, words
from manitwin.dataset.statistics.page import FOLDER, REPORT, NearPairs, Report, ReportSection, report_section
from manitwin.dataset.statistics.query import PRELUDE, Query, ReportTables, Result
from manitwin.dataset.statistics.style import Figure, report_style
from manitwin.twin.dataset_root import DatasetRoot

MOST_PAIRS = 1000
"""Maximum number of near-duplicate pairs written, nearest first, with the call that finds all of them."""
NO_TWIN = "There is no accepted twin."
VIEWS = "the views twins, points, grasps, placements, rejections and stages of the data set’s index"

QUERIES: tuple[Query, ...] = (
    *(stages.TOTALS, stages.SUCCESS_BY_STAGE, stages.REJECTIONS_BY_REASON, stages.BESIDE_THE_PAPER),
    *(grasps.GRASPS_PER_OBJECT, grasps.VERIFICATION_RATE, grasps.BY_GRIPPER, grasps.OUTCOMES, grasps.BY_GRASP_TYPE),
    *(grasps.ROBUST, grasps.SECOND_ENGINE, grasps.SIMULATED_HISTOGRAM, grasps.VERIFIED_HISTOGRAM),
    *(grasps.RATE_HISTOGRAM, grasps.ROBUSTNESS_HISTOGRAM),
    *(objects.POINTS_PER_OBJECT, objects.FUNCTIONAL_LABELS, objects.PLACEMENTS, *objects.COUNT_HISTOGRAMS),
    *(objects.DIMENSIONS, objects.SIZE_HISTOGRAM, objects.MASS_HISTOGRAM, objects.MASS_SOURCES, objects.MASS_AND_SIZE),
    *(objects.CATEGORIES, *objects.WORDS),
    *(stages.COST, stages.COST_BY_STAGE, stages.BACKENDS),
    *(stages.SOURCES, stages.LICENCES, stages.SAME_SOURCE, stages.FINDINGS, stages.CONFIGURATIONS),
)
"""All queries except ``mass_in_prior``, which depends on the categories found."""


@dataclass(frozen=True)
class WrittenReport:
    """A written report: the path or URL of its page, and its first sentence without the full stop.

    ``text`` has the main numbers of a report on episodes as lines; empty for data sets.
    """

    page: str
    summary: str
    text: str = ""


def write_dataset_report(root: DatasetRoot, out: Path | None = None) -> WrittenReport:
    """Write the report of a data set to a folder, by default ``statistics/`` in the data set.

    Raises UsageError if the data set has no index.
    """
    tables = ReportTables.of_index(root)
    duplicates = near_duplicates(Index(root))
    title = f"Statistics of {PurePosixPath(root.path).name or root.url}"
    if out is None and root.local is None:
        with tempfile.TemporaryDirectory() as scratch:
            fresh = Path(scratch) / FOLDER
            summary = write_report(tables, fresh, title=title, duplicates=duplicates)
            root.put_folder(fresh, FOLDER)
        return WrittenReport(f"{root.url.rstrip('/')}/{FOLDER}/{REPORT}", summary)
    folder = out or Path(root.full(FOLDER))
    return WrittenReport(str(folder / REPORT), write_report(tables, folder, title=title, duplicates=duplicates))


def run_queries(tables: ReportTables) -> dict[str, Result]:
    """Return the result of every query by its name."""
    results = {query.name: tables.result(query) for query in QUERIES}
    found = objects.priors_of(row["category"] for row in results["categories"].rows)
    against = tables.result(objects.mass_in_prior(found))
    return {**results, against.query.name: against}


def write_report(tables: ReportTables, out: Path, *, title: str, duplicates: NearDuplicates | None = None) -> str:
    """Write the report of tables to a folder; return the page's first sentence. Equal tables give equal bytes."""
    results = run_queries(tables)
    near = None if duplicates is None else _near_pairs(duplicates)
    with report_style():
        figures = draw_figures(results)
    lead = _lead(results)
    report = Report(title, lead, PRELUDE, VIEWS, results, figures, report_sections(results, figures, near))
    report.write(out, near_duplicates=None if near is None else vars(near))
    return lead[0].rstrip(".")


def draw_figures(results: dict[str, Result]) -> dict[str, Figure | None]:
    """Return all figures by name, None if there is nothing to draw."""
    of = results.__getitem__
    of_size, of_mass = ((of(name), of("dimensions")) for name in ("size_histogram", "mass_histogram"))
    figures = {
        "success_by_stage": bars.success_by_stage(of("success_by_stage")),
        "rejections": bars.rejections(of("rejections_by_reason")),
        "grasps_per_object": histograms.grasps_per_object(of("simulated_histogram"), of("verified_histogram")),
        "verification_rates": histograms.shares(
            *(of("rate_histogram"), "verification_rates", "Verification rate of objects."),
            *("verification rate", "objects", 20),
        ),
        "robustness": histograms.shares(
            *(of("robustness_histogram"), "robustness", "Perturbed trials that a verified grasp holds in."),
            *("share of perturbed trials held", "verified grasps", 10),
        ),
        "failed_outcomes": bars.outcomes(of("failed_outcomes")),
        "points_per_object": histograms.counts_per_object([of(query.name) for query in objects.COUNT_HISTOGRAMS]),
        "sizes": histograms.logarithmic(*of_size, objects.SIZE_STEPS, "sizes", "longest side", "m"),
        "masses": histograms.logarithmic(*of_mass, objects.MASS_STEPS, "masses", "mass", "kg"),
        "mass_and_size": masses.mass_and_size(of("mass_and_size"), of("mass_in_prior")),
        "mass_by_category": masses.mass_by_category(of("mass_in_prior")),
        "categories": bars.categories(of("categories")),
        "cost_by_stage": bars.cost(of("cost_by_stage")),
    }
    clouds = {f"words_{a}": words.word_cloud(of(f"words_{a}"), a) for a in objects.ATTRIBUTES}
    return {**figures, **clouds}


def report_sections(
    results: dict[str, Result], figures: dict[str, Figure | None], near: NearPairs | None
) -> list[ReportSection]:
    """Return the report's sections with their tables and figures in order."""
    section = partial(report_section, results, figures, empty=NO_TWIN)
    accepted = results["totals"].only["accepted"] > 0
    about_twins = [
        section(
            *("grasps", "Grasps", "grasps_per_object", "figure:grasps_per_object", "verification_rate"),
            *(("verification_rates", "robustness"), "by_gripper", "figure:failed_outcomes", "failed_outcomes"),
            *("by_grasp_type", "robust", "second_engine"),
        ),
        section(
            *("points", "Points and placements", "points_per_object", "figure:points_per_object"),
            *("functional_labels", "placements"),
        ),
        section(
            *("size", "Size and mass", "dimensions", ("sizes", "masses"), "figure:mass_and_size"),
            *("figure:mass_by_category", "mass_in_prior", "mass_sources"),
        ),
        section("categories", "Categories", "figure:categories", "categories"),
        section("words", "Words", tuple(f"words_{attribute}" for attribute in objects.ATTRIBUTES)),
    ]
    origin = section(
        *("sources", "Sources, licences and provenance", "sources", "licences", "same_source"),
        empty="Nothing was given.",
    )
    rest = section("made", "Findings and configurations", "findings", "configurations", "backends", empty="None.")
    return [
        section(
            *("outcome", "Accepted and rejected", "totals", "figure:success_by_stage", "success_by_stage"),
            *("figure:rejections", "rejections_by_reason", "beside_the_paper"),
        ),
        *(about_twins if accepted else [ReportSection("twins", "Twins", NO_TWIN, ())]),
        section("cost", "Time and money", "cost", "figure:cost_by_stage", "cost_by_stage"),
        replace(origin, parts=(*origin.parts, near)) if near else origin,
        rest,
    ]


def _near_pairs(duplicates: NearDuplicates) -> NearPairs:
    twins = {twin_id for pair in duplicates.pairs for twin_id in (pair.first, pair.second)}
    return NearPairs(
        nearest=[asdict(pair) for pair in duplicates.pairs[:MOST_PAIRS]],
        pairs=len(duplicates.pairs),
        twins=len(twins),
        found_by=f"manitwin.near_duplicates(Index(DATASET)): shapes at most {MAX_SHAPE_DISTANCE} apart, "
        f"sizes at most {100 * (MAX_SIZE_RATIO - 1):.0f} %",
    )


def _lead(results: dict[str, Result]) -> list[str]:
    """Return the summary of the report in at most two sentences."""
    totals, rate = results["totals"].only, results["verification_rate"].rows
    if not totals["items"]:
        return ["No item has ended yet: there is nothing to count."]
    said = [f"{totals['items']:,} items: {totals['accepted']:,} accepted, {totals['rejected']:,} rejected."]
    if rate and totals["accepted"]:
        first = rate[0]
        share = "" if first["rate"] is None else f" ({100 * first['rate']:.1f} %)"
        categories = len(results["categories"].rows)
        said.append(
            f"The accepted twins are of {categories:,} categories; {first['held']:,} of {first['tried']:,} simulated grasps "
            f"were verified{share}, {first['held'] / totals['accepted']:.1f} a twin."
        )
    return said
