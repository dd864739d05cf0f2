"""Whether a name would make more of a twin that was built without one, by what its record says."""

from __future__ import annotations

from manitwin.twin.record import TwinRecord

NAME_HINT = "say what it is with --name (mug, fork, ...) or a column name"

UNKNOWN = "prior:unknown"
RULES = "rules"
"""The annotator that knows of a thing what its prior says: of a nameless one, the prior of anything."""

OF_SIZE = frozenset({"too_wide", "too_thin", "no_proposal", "none_held"})
OF_MASS = frozenset({"none_held"})
IMPLAUSIBLE = frozenset({"implausible_size", "implausible_mass"})


def name_would_help(record: TwinRecord) -> bool:
    """Tell whether the result rests on what is true of anything, and a name would put something better in its place.

    Accepted: size, mass or friction are of ``prior:unknown``. Rejected: where a size or mass of that prior decided, where size
    and mass contradict each other, or where the posture of a lifted photo did, which the name has a say in.
    """
    if record.name is not None:
        return False
    if record.physical is not None:
        physical = record.physical
        return UNKNOWN in (physical.mass_kg.source, physical.friction_static.source)
    if record.rejection is None:
        return False
    reason, stages = record.rejection.reason, record.provenance.stages
    if reason in IMPLAUSIBLE:
        return True
    if reason == "no_stable_pose":
        return "generate" in stages and stages["generate"].backend == "lift"
    if "physical" not in stages or stages["physical"].backend != RULES:
        return False
    size_known = any(check.name == "plausible_size" and check.passed is not None for check in record.quality.checks)
    return reason in (OF_MASS if size_known else OF_SIZE)
