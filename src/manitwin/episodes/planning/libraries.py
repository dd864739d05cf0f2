"""Third-party libraries for planning, imported in one place: pinocchio (kinematics), coal (collision), toppra (timing)."""

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
    """Import toppra on first use (it takes a second); raises Unavailable if it is not installed."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # its docstrings contain invalid escape sequences
            import toppra
            import toppra.algorithm
            import toppra.constraint
    except ImportError as error:
        raise Unavailable(f"planning needs toppra ({error}): {import_remedy(error, REMEDY)}") from error
    logging.getLogger("toppra").setLevel(logging.ERROR)  # it logs every path that cannot be timed
    return toppra
