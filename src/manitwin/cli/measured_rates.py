"""What an input of a kind takes by the published measurements, where a data set has too few of its own to tell."""

from __future__ import annotations

from dataclasses import dataclass

from manitwin.config import BuildConfig

CHAIN_CPU_S = {"mesh": 6.1, "image": 7.9, "text": 4.0}
FURTHER_PHOTO_CPU_S = 4.7
"""Of several photos of one thing each after the first: to cut it out, and to fit a template to it."""
SECOND_ENGINE_CPU_S = 3.4
ROBUSTNESS_CPU_S = 7.9
DOUBTS_CPU_S = 0.5
TRIALS_CPU_S = 2.7
"""Medians (docs/measured/cost.md, "What an input takes"): the whole chain with ``--quick`` by the kind of input, what the second
engine, robustness and second trials of doubtful grasps add for each gripper, and what each further gripper adds. Of
generators the built-in one."""
MEASURED = "docs/measured/cost.md, medians"


@dataclass(frozen=True)
class Rate:
    """CPU seconds that an item of a kind takes, and whose figure that is."""

    cpu_s: float
    source: str


def measured_rate(config: BuildConfig, kind: str, photos: float = 1.0) -> Rate:
    """Return what an item takes by the published measurements, for these grippers and engines; ``photos`` in the mean each."""
    grippers = len(config.grippers)
    each = SECOND_ENGINE_CPU_S * config.second_opinion.enabled + ROBUSTNESS_CPU_S * config.robustness.enabled
    each += DOUBTS_CPU_S * config.verify.doubts_tried_again
    chain = CHAIN_CPU_S["image" if kind == "photos" else kind] + FURTHER_PHOTO_CPU_S * (photos - 1.0)
    return Rate(chain + TRIALS_CPU_S * (grippers - 1) + each * grippers, MEASURED)
