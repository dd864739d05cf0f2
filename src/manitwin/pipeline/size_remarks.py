"""Phrases in messages on implausible sizes; remedies look for them."""

from __future__ import annotations

TRULY_LARGE = "is that large, and no gripper here holds it"
"""For objects too large for a twin whose size is typical of their kind."""

CHECK_SCALE = "check its unit and scale first"
