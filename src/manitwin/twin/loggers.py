"""The package's loggers that several modules tell: silent until somebody listens."""

from __future__ import annotations

import logging

PACKAGE = logging.getLogger("manitwin")
"""The parent of all of them."""
RUN = logging.getLogger("manitwin.run")
"""Where every event of a run is told: an item that ends and a stage that ends as INFO, a stage that begins as DEBUG."""

PACKAGE.addHandler(logging.NullHandler())  # else Python prints warnings where nobody listens
