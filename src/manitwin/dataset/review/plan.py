"""Drawing of a review sample, and its distribution to annotators as forms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from manitwin.dataset.index.query import Index
from manitwin.dataset.review.queues import Plan, queue_of
from manitwin.dataset.review.review_subjects import revisions
from manitwin.dataset.review.sample import listed_twins, strata_counts, stratified_sample
from manitwin.dataset.review.store import ReviewStore, reviews_path
from manitwin.dataset.review.verdict_files import write_form
from manitwin.dataset.review.verdicts import AnnotatorName, reason_of
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot


def draw_plan(dataset: str, size: int, seed: int, overlap: float) -> tuple[Plan, Mapping[str, tuple[int, int]]]:
    """Draw and store the sample to review; return it with, per category, the number of twins in the sample and in total.

    Raises UsageError if the data set has no index or no accepted twins.
    """
    root = DatasetRoot(dataset)
    path, twins = reviews_path(root), listed_twins(Index(root))
    if not twins:
        raise UsageError(f"{dataset}: it has no accepted twins to review; build some first")
    plan = Plan(tuple(stratified_sample(twins, size, seed)), seed, overlap)
    with ReviewStore(path) as store:
        store.add_plan(plan)
    return plan, strata_counts(twins, plan.twins)


def write_forms(dataset: str, plan: Plan, form: Path | None, annotators: Sequence[str]) -> list[tuple[Path, int]]:
    """Write the form of each annotator beside ``form``; return the files with their numbers of rows."""
    if form is None:
        return []
    if form.suffix != ".csv":
        raise UsageError(f"{form}: a form is CSV; give a name that ends in .csv")
    names = list(dict.fromkeys(require_annotator(name) for name in annotators))
    root = DatasetRoot(dataset)
    now = revisions(Index(root))
    with ReviewStore(reviews_path(root)) as store:
        judged = store.annotators_by_revision()
    done = {twin_id: judged.get(twin_id, {}).get(revision, set()) for twin_id, revision in now.items()}
    written = []
    for name in names:
        own = [each for each in queue_of(name, plan, names, done) if name in plan.assigned(each, names)]
        file = form if len(names) == 1 else form.with_stem(f"{form.stem}-{name}")
        written.append((file, write_form(file, root, (each for each in own if each in now), name)))
    return written


def require_annotator(name: str) -> str:
    """Return a valid annotator name; raises UsageError for an invalid one."""
    try:
        return str(TypeAdapter(AnnotatorName).validate_python(name))
    except ValidationError as error:
        raise UsageError(f"annotator: {reason_of(error)}") from error
