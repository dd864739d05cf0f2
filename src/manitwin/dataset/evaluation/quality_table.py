"""Similarity to the input as table rows, with control and paper figures, and as sample pictures."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean
from typing import Any

from manitwin.dataset.evaluation.input_likeness import METRICS, OF_PICTURES, OUTLINE, Likeness
from manitwin.dataset.evaluation.paper_figures import CLAY, GENERATION_QUALITY, GENERATION_TIME_S
from manitwin.dataset.report_page import Picture
from manitwin.formats.image_file import png_of
from manitwin.twin.proportions import wilson_interval

MOST_PICTURES = 28
_NOT_MEASURED = "not measured: no model was given (--clip, --ulip)"
_BUILT_IN = (
    "no figure of the paper; a built-in template takes colours and outline from the photo itself, which this sees"
)


def quality_rows(found: Sequence[Likeness], seconds: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return a row per metric and kind of input, and the generation time (``seconds``: rows by ``input``)."""
    rows = []
    for kind in ("image", "text"):
        some = [each for each in found if each.source.kind == kind]
        rows += [_row(metric, kind, some) for metric in METRICS if kind == "image" or metric not in OF_PICTURES]
        took = next((row for row in seconds if row["input"] == kind), None)
        why = "theirs is a service's answer, ours the stage's wall time on this machine with what else it did"
        rows.append(
            _columns("time of generation, s", kind, took["seconds"] if took else None, took["objects"] if took else 0)
            | {"paper": GENERATION_TIME_S, "comparable": "no", "why": why}
        )
    return rows


def _row(metric: str, kind: str, some: Sequence[Likeness]) -> dict[str, Any]:
    values = [each.own[metric] for each in some if metric in each.own]
    pairs = [(each.own[metric], each.shuffled[metric]) for each in some if metric in each.shuffled]
    row = _columns(metric, kind, fmean(values) if values else None, len(values))
    if pairs:
        higher = sum(own > other for own, other in pairs)
        low, high = wilson_interval(higher, len(pairs))
        row |= {"shuffled": fmean(other for _, other in pairs), "pairs": len(pairs)}
        row |= {"matched_higher": higher / len(pairs), "low": low, "high": high}
    paper = GENERATION_QUALITY.get(metric, {}).get(kind)
    if paper is None:
        return row | {"comparable": "no", "why": _BUILT_IN}
    comparable, why = ("in part", CLAY) if values else ("no", _NOT_MEASURED if some else f"no twin is of {kind}")
    return row | {"paper": paper, "comparable": comparable, "why": why}


def _columns(metric: str, kind: str, here: float | None, objects: int) -> dict[str, Any]:
    absent = dict.fromkeys(("shuffled", "pairs", "matched_higher", "low", "high", "paper"))
    return {"metric": metric, "input": kind, "here": here, "objects": objects} | absent


def twin_rows(found: Sequence[Likeness]) -> list[dict[str, Any]]:
    """Return a row per twin with its similarity to its own and to the control input."""
    return [
        {
            "twin_id": each.twin_id,
            "name": each.name,
            "category": each.category,
            "input": each.source.kind,
            "shuffled_with": each.shuffled_with,
            **{metric: each.own.get(metric) for metric in METRICS},
            **{f"{metric}, shuffled": each.shuffled.get(metric) for metric in METRICS},
            "left_out": each.source.left_out,
        }
        for each in found
    ]


def sample_pictures(found: Sequence[Likeness]) -> list[Picture]:
    """Return the pictures of twins made from images, least similar silhouette first."""
    shown = sorted(
        (each for each in found if each.picture is not None), key=lambda each: (each.own[OUTLINE], each.twin_id)
    )
    return [
        Picture(
            png_of(each.picture),
            f"{each.category} {each.twin_id}: input, the view of the most like outline, its normals; silhouette IoU "
            f"{each.own[OUTLINE]:.2f}",
        )
        for each in shown[:MOST_PICTURES]
        if each.picture is not None
    ]
