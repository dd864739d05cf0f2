"""Access to one gripper's tried grasps and verdicts: the selected, the unfiltered, then those added at grasp points."""

from __future__ import annotations

import numpy as np

from manitwin.engine.stage import Draft
from manitwin.pipeline.grasps import PROPOSALS
from manitwin.pipeline.verify import VERDICTS

POINT_PROPOSALS, POINT_VERDICTS = "point_proposals.npz", "point_verdicts.npz"
"""All rows of the first gripper: those of ``proposals.npz`` and ``verdicts.npz``, followed by those added at points."""


def tried_names(suffix: str) -> tuple[str, ...]:
    """Return the artifacts to read for the tried grasps of the gripper with this suffix."""
    more = () if suffix else (f"{POINT_PROPOSALS}?", f"{POINT_VERDICTS}?")
    return (PROPOSALS.format(suffix), VERDICTS.format(suffix), *more)


def read_tried(draft: Draft, suffix: str) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the arrays of proposals and verdicts, row by row."""
    if not suffix and POINT_PROPOSALS in draft.paths:
        return read_arrays(draft, POINT_PROPOSALS), read_arrays(draft, POINT_VERDICTS)
    return read_arrays(draft, PROPOSALS.format(suffix)), read_arrays(draft, VERDICTS.format(suffix))


def read_arrays(draft: Draft, name: str) -> dict[str, np.ndarray]:
    """Return the arrays of a file artifact."""
    with np.load(draft.path(name)) as arrays:
        return dict(arrays)
