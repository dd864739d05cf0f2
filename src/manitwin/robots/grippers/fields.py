"""How strictly a gripper's file is read."""

from pydantic import ConfigDict

STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
"""A key that means nothing is an error: it is a misspelt one."""
