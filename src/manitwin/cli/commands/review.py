"""``manitwin review``: people judge a sample of twins, and what their verdicts add up to."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import error_console, out_console, print_error
from manitwin.cli.documents import Json, print_document

if TYPE_CHECKING:
    from manitwin.web.serve import PageServer

ACCESS = "reviews.access.json"
"""Beside the reviews: who was let in before."""
SAMPLED = 500
"""As many as the paper's annotators judged."""

Dataset = Annotated[
    str,
    options.existing_path_argument(
        "A data set: a folder with an index.", "DATASET", "a data set that manitwin build made"
    ),
]
Sample = Annotated[
    int,
    typer.Option(
        "--sample", help="Number of twins to review.", callback=option_values.count_callback("--sample", 1_000_000)
    ),
]
Overlap = Annotated[
    float,
    typer.Option(
        help="Fraction of the sample that two annotators judge independently, to measure agreement.", min=0.0, max=1.0
    ),
]
SampleSeed = Annotated[int, typer.Option("--seed", help="Random seed of the sample.", min=0, max=options.LARGEST_SEED)]


Annotators = Annotated[
    list[str] | None,
    typer.Option("--annotator", help="Name of the annotator; several annotators share the sample.", metavar="NAME"),
]
Given = Annotated[
    int | None,
    typer.Option(
        "--sample", help="Number of twins to review.", callback=option_values.count_callback("--sample", 1_000_000)
    ),
]


def review(
    dataset: Dataset,
    sample: Given = None,
    seed: SampleSeed = 1,
    overlap: Overlap = 0.2,
    annotator: Annotators = None,
    blind: Annotated[
        bool, typer.Option("--blind", help="Hide the source, confidence and evidence of the annotations.")
    ] = False,
    revoke: Annotated[bool, typer.Option("--revoke", help="Revoke all earlier links and browser sessions.")] = False,
    port: Annotated[
        int, typer.Option(help="Port; 0: the port of the last session, or any free port.", min=0, max=65535)
    ] = 0,
    host: Annotated[
        str, typer.Option(help="Address to listen on; 0.0.0.0 lets other machines connect.", metavar="ADDRESS")
    ] = "127.0.0.1",
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
) -> None:
    """Review a sample of twins in the browser by keyboard, until interrupted; without --sample, the last sample drawn."""
    import webbrowser

    from manitwin.cli.commands.view import has_screen, print_unlogged_link, stop_server_on_interrupt, warn_if_open
    from manitwin.dataset.index.query import Index
    from manitwin.dataset.review.plan import draw_plan, require_annotator
    from manitwin.dataset.review.session import ReviewSession
    from manitwin.dataset.review.store import ReviewStore, reviews_path
    from manitwin.twin.dataset_root import DatasetRoot
    from manitwin.web.review_page import PATH
    from manitwin.web.serve import review as serve_review
    from manitwin.web.tokens import AccessFile, Tokens

    names = [require_annotator(name) for name in annotator or ["me"]]
    root = DatasetRoot(dataset)
    if sample is not None:
        draw_plan(dataset, sample, seed, overlap)
    tokens = Tokens(AccessFile(reviews_path(root).with_name(ACCESS)))
    if revoke:
        tokens.revoke_all()
    with ReviewStore(reviews_path(root)) as store, stop_server_on_interrupt() as ends_with:
        kept = store.plan()
        plan = kept if kept is not None else draw_plan(dataset, SAMPLED, seed, overlap)[0]
        session = ReviewSession(store, Index(root), plan, names, blind=blind)

        def ready(server: PageServer) -> None:
            ends_with(server)
            warn_if_open(server)
            tell(server)
            if browser and has_screen():
                webbrowser.open(server.link(PATH, names[0]))

        def tell(server: PageServer) -> None:
            for name in names:
                left = session.progress(name).left
                print_unlogged_link(
                    server.link(PATH, name), f"for {name} alone, {left} twins; until interrupted (Ctrl-C)"
                )

        serve_review(dataset, session, host, port, ready, tell, tokens)
        out_console.print(f"`manitwin review report {dataset}` summarises the verdicts")
        out_console.print("stopped")


def review_sample(
    dataset: Dataset,
    sample: Sample = SAMPLED,
    seed: SampleSeed = 1,
    overlap: Overlap = 0.2,
    form: Annotated[
        Path | None,
        typer.Option(
            help="Write a form to fill in: one row per answer and dimension.", metavar="FILE.csv", dir_okay=False
        ),
    ] = None,
    annotator: Annotators = None,
) -> None:
    """Draw a sample stratified by category, size and origin, and write a form for verdicts made outside the browser."""
    from manitwin.errors import UsageError

    if (form is None) != (not annotator):
        raise UsageError("a form is for one annotator: give --form FILE.csv and --annotator NAME together")
    from manitwin.dataset.review.plan import draw_plan, write_forms

    plan, strata = draw_plan(dataset, sample, seed, overlap)
    twice = sum(plan.wanted(twin_id) > 1 for twin_id in plan.twins)
    out_console.print(f"{len(plan.twins)} twins of {len(strata)} categories, {twice} of them for two annotators")
    if len(plan.twins) < sample:
        out_console.print(f"these are all accepted twins; the sample may have {sample}")
    for file, rows in write_forms(dataset, plan, form, annotator or []):
        out_console.print(f"{file}: {rows} rows to fill in; `manitwin review import {dataset} {file}` imports it")


def review_import(
    dataset: Dataset,
    verdicts: Annotated[
        Path,
        options.existing_path_argument(
            "Verdicts, one row per answer (docs/review.md).", "FILE.csv|FILE.jsonl", "a CSV or JSONL file of verdicts"
        ),
    ],
) -> None:
    """Import verdicts made elsewhere: a whole file or nothing; verdicts that are there already are skipped."""
    from manitwin.dataset.review.review_subjects import read_twin
    from manitwin.dataset.review.store import ReviewStore, reviews_path
    from manitwin.dataset.review.verdict_files import read_verdicts
    from manitwin.twin.dataset_root import DatasetRoot

    root = DatasetRoot(dataset)
    path, read = reviews_path(root), read_verdicts(verdicts, root)
    with ReviewStore(path) as store:
        added = store.add((review for review, _ in read), (request for _, request in read))
        followed = store.successor_function()
    there = f", {len(read) - added} were already there" if added < len(read) else ""
    out_console.print(f"{added} reviews imported{there}; `manitwin review report {dataset}` summarises them")
    now = {twin_id: read_twin(root, twin_id).revision for twin_id in {review.twin_id for review, _ in read}}
    if outdated := sum(followed(each.twin_id, each.revision) != now[each.twin_id] for each, _ in read):
        error_console.print(
            f"{outdated} of the reviews of {verdicts} are of twins that were built anew since, and do not count"
        )


def review_apply(
    dataset: Dataset,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print what would be corrected and what is disputed; write nothing.")
    ] = False,
    jobs: options.Jobs = None,
) -> None:
    """Write uncontradicted corrections into the twins, and rebuild what depends on them."""
    from manitwin.cli.progress import RunDisplay
    from manitwin.dataset.review.apply import apply_reviews
    from manitwin.dataset.review.report import correction_text
    from manitwin.engine.amendments import amendments_name

    if dry_run:
        done = apply_reviews(dataset, dry_run=True)
    else:
        with RunDisplay("twins", dataset) as watched:
            done = apply_reviews(dataset, jobs=jobs, **watched.callbacks)
    for each in done.corrections:
        out_console.print(f"{each.twin_id} {each.name}: {correction_text(each.value)} ({each.source})")
    for conflict in done.conflicts:
        said = ", ".join(f"{name} says {correction_text(value)}" for name, value in conflict.said.items())
        out_console.print(f"not applied: {conflict.twin_id} {conflict.name}: {said}")
    for twin_id, reason in done.left.items():
        out_console.print(f"not applied: {twin_id}: {reason}")
    for twin_id, reason in done.rejected.items():
        print_error(
            f"{twin_id} is rejected with its corrections: {reason}; where that is wrong, remove {dataset}/"
            f"{amendments_name(twin_id)} and run `manitwin retry {dataset} --state rejected` and the build again"
        )
    verb = "would be" if dry_run else "are"
    out_console.print(f"{len(done.corrections)} corrections {verb} applied, {len(done.conflicts)} are disputed")
    unfinished = done.run is not None and (done.run.open or done.run.counts_of_given.get("failed"))
    if unfinished:
        print_error(f"twins are not all made again; `manitwin status {dataset}` says why")
    raise typer.Exit(4 if unfinished else 3 if done.conflicts or done.left or done.rejected else 0)


def review_report(
    dataset: Dataset,
    export: Annotated[
        Path | None,
        typer.Option(
            help="Also write all verdicts to a .parquet, .csv or .jsonl file.", metavar="FILE", dir_okay=False
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Print accuracy per dimension beside the paper's, agreement, progress, and disputed or wrong annotations."""
    from manitwin.dataset.review.report import export_verdicts, review_report

    report = review_report(dataset)
    for line in report.lines():
        out_console.print(line)
    if export is not None:
        out_console.print(f"{export}: {export_verdicts(dataset, export)} verdicts")
    if json:
        print_document(report.document())


def review_tune(
    dataset: Dataset,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            help="Write the proposed thresholds as a configuration file.",
            metavar="FILE.toml",
            dir_okay=False,
        ),
    ] = None,
) -> None:
    """Propose thresholds that agree better with the verdicts, if they also do so on held-out twins."""
    from manitwin.dataset.review.tuning import proposals_toml, tune_dataset
    from manitwin.twin.store import write_bytes_atomically

    tuned = tune_dataset(dataset)
    for each in tuned:
        out_console.print(each.line())
    proposed = proposals_toml(tuned)
    if not proposed:
        out_console.print("no threshold is proposed")
    elif out is not None:
        write_bytes_atomically(out, proposed.encode())
        out_console.print(f"{out}: check this file, then pass it to `manitwin build --config {out}`")
