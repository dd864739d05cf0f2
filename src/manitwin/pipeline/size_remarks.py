"""What messages say of sizes that are unlikely, or no hand's; remedies go by it."""

from __future__ import annotations

TRULY_LARGE = "is that large, and no gripper here holds it"
"""Of what is too large for a twin and has the size of such things."""

CHECK_SCALE = "check its unit and scale first"
