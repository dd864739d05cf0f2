"""Workers share the cores: each does its own work in one thread."""

from __future__ import annotations

import os


def one_thread_each() -> None:
    """Keep libraries that are loaded later from starting threads of their own, where the environment does not say.

    OpenMP's, and those of Mesa's lavapipe, which 0 makes draw in the thread that asks: two workers on two cores then
    spend a sixth less on a picture.
    """
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("LP_NUM_THREADS", "0")
