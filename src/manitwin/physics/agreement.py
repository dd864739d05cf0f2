"""How far two engines agree on the same grasps."""

from __future__ import annotations

import numpy as np


def cohens_kappa(first: np.ndarray, second: np.ndarray) -> float | None:
    """Return Cohen's kappa of two boolean verdicts ``(N,)``; None where it is not defined: no rows, or chance alone agrees.

    kappa = (p_o - p_e) / (1 - p_e) with p_e from the two marginals (Cohen 1960, "A coefficient of agreement for nominal
    scales").
    """
    if not len(first):
        return None
    p, q = float(np.mean(first)), float(np.mean(second))
    observed, by_chance = float(np.mean(first == second)), p * q + (1 - p) * (1 - q)
    return None if by_chance == 1 else (observed - by_chance) / (1 - by_chance)
