"""The libraries that planning stands on, imported in one place: pinocchio's kinematics, coal's collisions, toppra's timing."""

from __future__ import annotations

import logging
import warnings
from functools import cache
from typing import Any

from manitwin.errors import Unavailable
from manitwin.formats.installation import import_remedy

REMEDY = "pip install 'manitwin[robots]'"

try:
    import coal
    import eigenpy  # type: ignore[import-untyped]
    import pinocchio as pin
except ImportError as error:
    raise Unavailable(f"planning needs pin ({error}): {import_remedy(error, REMEDY)}") from error

__all__ = ["coal", "eigenpy", "pin", "toppra_library"]


@cache
def toppra_library() -> Any:
    """Import toppra when it is first needed (it takes a second); raises Unavailable where it is not installed."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # its docstrings have escapes that newer Pythons warn of
            import toppra
            import toppra.algorithm
            import toppra.constraint
    except ImportError as error:
        raise Unavailable(f"planning needs toppra ({error}): {import_remedy(error, REMEDY)}") from error
    logging.getLogger("toppra").setLevel(logging.ERROR)  # tells of every path that cannot be timed
    return toppra
