"""Which libraries a fresh interpreter has loaded once it has imported some modules."""

from __future__ import annotations

import subprocess
import sys


def imported_of(libraries: set[str], *modules: str) -> set[str]:
    """Return those of ``libraries`` that importing ``modules`` loads."""
    program = f"import sys, {', '.join(modules)}\nprint(*({libraries!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(done.stdout.split())
