"""Acceptance of a doubtful mask whose outline matches the template of the named object: an independent second opinion.

A mask that includes a shadow, lacks a part or fills a hole hardly ever has the outline of a template. The shape does not tell
whether the picture shows one whole object; that is left to the scores.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from manitwin.models.matting.candidates import AGREEING, alike
from manitwin.models.matting.study import ScoredCandidate, Study, drawn

Explains = Callable[[np.ndarray], bool]
"""Predicate on a cut-out ``rgba (H, W, 4) uint8``: whether it has the outline of the object that the photo is said to show."""


def prefer_explained(
    rgb: np.ndarray, study: Study, explains: Explains, *, min_confidence: float, working_side_px: int = 512
) -> Study:
    """Return the study of a photo ``rgb (H, W, 3) uint8`` with a candidate first whose outline ``explains`` confirms.

    Candidates are tested in order of confidence. Those that would not reach ``min_confidence`` even if confirmed, and those
    that may not be one whole object, are not tested. If no candidate is confirmed, the study is returned unchanged.
    """
    asked: list[ScoredCandidate] = []
    for each in study.judged:
        would_be = replace(each, is_explained=True)
        if would_be.confidence < min_confidence:
            break
        mask = each.candidate.found.mask
        if not each.candidate.scores.is_whole_object or any(
            alike(mask, other.candidate.found.mask) > AGREEING for other in asked
        ):
            continue
        asked.append(each)
        alpha = study.alpha if each is study.judged[0] else drawn(rgb, mask, working_side_px)
        if explains(np.dstack([rgb, alpha])):
            others = [other for other in study.judged if other is not each]
            return replace(study, judged=[would_be, *others], alpha=alpha)
    return study
