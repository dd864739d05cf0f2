"""A doubtful cut-out whose outline is that of the thing that the photo is said to show: a second, independent opinion.

With a shadow taken for a part, a part left out or a hole filled a mask hardly has the outline of a template. A shape does not
tell whether one whole thing is in the picture: there the scores decide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from manitwin.models.matting.candidates import AGREEING, alike
from manitwin.models.matting.study import Judged, Study, drawn

Explains = Callable[[np.ndarray], bool]
"""Tells of a cut-out ``rgba (H, W, 4) uint8`` whether it has the outline of the thing that it is said to be."""


def explained_first(
    rgb: np.ndarray, study: Study, explains: Explains, *, min_confidence: float, working_side_px: int = 512
) -> Study:
    """Return the study of a photo ``rgb (H, W, 3) uint8`` with a candidate first that a shape ``explains``.

    The likeliest is asked first, and none that would not reach ``min_confidence`` even so, or that may be no whole thing; where
    none is explained, the study is returned as it is.
    """
    asked: list[Judged] = []
    for each in study.judged:
        would_be = replace(each, is_explained=True)
        if would_be.confidence < min_confidence:
            break
        mask = each.candidate.found.mask
        if not each.candidate.scores.of_one_whole or any(
            alike(mask, other.candidate.found.mask) > AGREEING for other in asked
        ):
            continue
        asked.append(each)
        alpha = study.alpha if each is study.judged[0] else drawn(rgb, mask, working_side_px)
        if explains(np.dstack([rgb, alpha])):
            others = [other for other in study.judged if other is not each]
            return replace(study, judged=[would_be, *others], alpha=alpha)
    return study
