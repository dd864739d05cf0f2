"""Logistic regression on words: how well the words of a question predict its answer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.sparse import csr_matrix

PENALTY = 1.0
"""The weight of half the squared weights (L2): the default of scikit-learn, C = 1."""


@dataclass(frozen=True)
class WordModel:
    """Weights by word, and a bias."""

    weights: dict[str, float]
    bias: float

    @classmethod
    def from_texts(cls, texts: Sequence[Iterable[str]], answers: Sequence[bool]) -> WordModel:
        """Fit the words of texts to their answers by L-BFGS; the same input gives the same weights."""
        rows = [sorted(set(text)) for text in texts]
        place = {word: number for number, word in enumerate(sorted({word for row in rows for word in row}))}
        starts = np.cumsum([0, *map(len, rows)])
        columns = np.array([place[word] for row in rows for word in row], np.int64)
        matrix = csr_matrix((np.ones(len(columns)), columns, starts), shape=(len(rows), len(place)))
        signs = np.where(np.asarray(answers, bool), 1.0, -1.0)

        def loss(values: np.ndarray) -> tuple[float, np.ndarray]:
            margins = signs * (matrix @ values[:-1] + values[-1])
            pull = -signs / (1 + np.exp(np.clip(margins, -500, 500)))
            gradient = np.append(matrix.T @ pull + PENALTY * values[:-1], pull.sum())
            value = np.logaddexp(0, -margins).sum() + PENALTY / 2 * values[:-1] @ values[:-1]
            return float(value), gradient

        found = minimize(loss, np.zeros(len(place) + 1), jac=True, method="L-BFGS-B", options={"maxiter": 200}).x
        return cls({word: float(found[number]) for word, number in place.items()}, float(found[-1]))

    def probability(self, text: Iterable[str]) -> float:
        """Return the probability of a positive answer."""
        score = self.bias + sum(self.weights.get(word, 0.0) for word in set(text))
        return float(1 / (1 + np.exp(-np.clip(score, -500, 500))))
