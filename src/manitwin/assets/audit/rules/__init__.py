"""All audit rules, in the order of the report."""

from __future__ import annotations

from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.rules import (
    center_of_mass,
    collision,
    contacts,
    files,
    frames,
    friction,
    grasps,
    inertia,
    joints,
    licence,
    mass,
    parts,
    placement,
    running,
    scale,
    textures,
    twin,
)

MODULES = (
    files, mass, inertia, center_of_mass, collision, scale, friction, joints, frames, contacts, grasps, placement, licence,
    textures, twin, running, parts
)  # fmt: skip

RULES: tuple[Rule, ...] = tuple(rule for module in MODULES for rule in module.RULES)
"""Every rule, ordered by subject."""

RULES_BY_CODE = {rule.code: rule for rule in RULES}
