"""Search twins of a data set by words or by a picture."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from manitwin.dataset.index.query import Index
from manitwin.dataset.search.vector_store import StoredVectors, VectorStore
from manitwin.dataset.search.words import rank_by_words, text_fields, unknown_words
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import sha256_of_json

if TYPE_CHECKING:
    from manitwin.models.embedders.foreground import Found
    from manitwin.models.embedders.texts import TextEmbedder

COLUMNS = (
    "twin_id",
    "revision",
    "name",
    "category",
    "color",
    "material",
    "size",
    "shape",
    "function",
    "caption",
    "longest_m",
)
BEST_VIEWS = 3
"""Number of best views whose mean similarity is a twin's score; a single view may match by chance."""
FUSION = 60
"""Constant of reciprocal rank fusion, added to each rank (Cormack, Clarke and Büttcher 2009, "Reciprocal rank fusion")."""


@dataclass(frozen=True)
class Hit:
    """A search result. ``score`` orders the hits of one search and is not comparable across searches.

    ``matched`` maps each question word to the fields that contain it; None for picture searches and for twins found by their
    embedding alone.
    """

    twin_id: str
    score: float
    category: str
    name: str | None
    caption: str
    matched: dict[str, list[str]] | None


def search_words(root: DatasetRoot, question: str, *, limit: int, embedder: TextEmbedder | None = None) -> list[Hit]:
    """Return at most ``limit`` twins that contain words of the question, best first, ranked by BM25.

    With an ``embedder``, all twins are also ranked by the cosine similarity of their caption vectors, which are stored, and both
    rankings are fused. Raises UsageError without an index or words.
    """
    rows = _rows(root)
    by_words = rank_by_words(question, [text_fields(row) for row in rows], [row["longest_m"] for row in rows])
    scores, matched = {hit.place: hit.score for hit in by_words}, {hit.place: hit.matched for hit in by_words}
    if embedder is not None and rows:
        asked = embedder.embed([question])[0]
        likeness = text_vectors(root, rows, embedder) @ asked
        nearest = np.argsort(-likeness, kind="stable").tolist()
        scores = _fuse_ranks([hit.place for hit in by_words], nearest)
    order = sorted(scores, key=lambda place: (-scores[place], place))[:limit]
    return [_hit(rows[place], scores[place], matched.get(place)) for place in order]


def find_unknown_words(root: DatasetRoot, question: str) -> dict[str, list[str]]:
    """Return the question words that occur in no twin of a data set, each with similarly spelt words that do."""
    return unknown_words(question, [text_fields(row) for row in _rows(root)])


def search_picture(
    root: DatasetRoot,
    pixels: np.ndarray,
    *,
    limit: int,
    on_twin: Callable[[str], None] = lambda twin_id: None,
) -> tuple[list[Hit], Found]:
    """Return the twins that look most like ``pixels (H, W, 3 or 4) uint8``, and how the foreground was segmented.

    Raises UsageError without an index, for a data set at a URL, and for a picture without a foreground.
    """
    from manitwin.dataset.search.appearance_vectors import load_appearance_vectors
    from manitwin.models.embedders.appearance import appearance_descriptor
    from manitwin.models.embedders.foreground import foreground

    rows = _rows(root)
    rgb, mask, found = foreground(pixels)
    try:
        look = appearance_descriptor(rgb, mask)
    except ValueError as error:
        raise UsageError(f"the picture shows no object ({error}); give a larger crop of one object") from error
    looks = dict(load_appearance_vectors(root, {row["twin_id"]: row["revision"] for row in rows}, on_twin))
    scores = [view_similarity(look, looks[row["twin_id"]]) for row in rows]
    order = np.argsort(-np.array(scores), kind="stable").tolist()[:limit]
    return [_hit(rows[place], scores[place], None) for place in order], found


def view_similarity(look: np.ndarray, views: np.ndarray) -> float:
    """Return the mean of the three largest dot products of a feature vector ``(D,)`` with those of a twin's views ``(V, D)``."""
    return float(np.sort(views.astype(np.float64) @ look.astype(np.float64))[-BEST_VIEWS:].mean())


def text_vectors(root: DatasetRoot, rows: Sequence[dict[str, Any]], embedder: TextEmbedder) -> np.ndarray:
    """Return the vectors ``(N, D)`` of the twins' descriptions; missing or outdated ones are computed and stored."""
    store = VectorStore(root, f"texts-{hashlib.sha256(embedder.identity.encode()).hexdigest()[:16]}")
    texts = [f"{row['category']}: {row['caption']}" for row in rows]
    digests = [sha256_of_json([embedder.identity, text]) for text in texts]
    kept = [store.read(row["twin_id"]) for row in rows]
    missing = [
        place
        for place, each in enumerate(kept)
        if each is None or each.content != digests[place] or len(each.vectors) != 1
    ]
    for place, vector in zip(missing, embedder.embed([texts[place] for place in missing]), strict=True):
        kept[place] = store.write(
            rows[place]["twin_id"], StoredVectors(rows[place]["revision"], digests[place], vector[None])
        )
    vectors = [each.vectors[0] for each in kept if each is not None]
    if len({len(vector) for vector in vectors}) > 1:
        raise UsageError(
            f"{root.url}/search: the vectors of one model have different lengths; remove the folder, and search again"
        )
    return np.array(vectors)


def _fuse_ranks(*orders: list[int]) -> dict[int, float]:
    scores: dict[int, float] = {}
    for order in orders:
        for rank, place in enumerate(order, 1):
            scores[place] = scores.get(place, 0.0) + 1 / (FUSION + rank)
    return scores


def _rows(root: DatasetRoot) -> list[dict[str, Any]]:
    """Return the twins of an index, each with the labels of its functional points as ``parts``."""
    index = Index(root)
    rows: list[dict[str, Any]] = index.select("twins", columns=COLUMNS).to_pylist()
    labels = defaultdict[str, list[str]](list)
    for point in index.select("points", columns=["twin_id", "role", "label"]).to_pylist():
        if point["role"] == "functional":
            labels[point["twin_id"]].append(point["label"])
    return [{**row, "parts": " ".join(labels[row["twin_id"]])} for row in rows]


def _hit(row: dict[str, Any], score: float, matched: dict[str, list[str]] | None) -> Hit:
    return Hit(row["twin_id"], score, row["category"], row["name"], row["caption"], matched)
