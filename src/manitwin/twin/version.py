"""The version that is installed."""

from __future__ import annotations

NO_METADATA = "0+unknown"


def installed_version() -> str:
    """Return manitwin's version; of a source tree that was never installed, ``0+unknown``."""
    from importlib.metadata import PackageNotFoundError, version  # 20 ms that `import manitwin` does without

    try:
        return version("manitwin")
    except PackageNotFoundError:
        return NO_METADATA
