"""Who a twin is: a hash of the input's bytes, name, units and up axis, and of nothing else.

What another tool says of an imported mesh is part of the input.
"""

from __future__ import annotations

from pathlib import Path

from manitwin.formats.source_files import side_files
from manitwin.pipeline.item import Item
from manitwin.twin.store import sha256_of_file, sha256_of_json

ID_DIGITS = 16
"""64 bits: among 100,000 twins two share an id with a probability of 3e-10."""


def twin_id(item: Item) -> str:
    """Return the id of the twin that an item makes; another configuration is another revision of the same twin."""
    if item.file is None:
        content: object = {"text": item.text}
    else:
        path = Path(item.file)
        root = path.parent.resolve()
        sides = {p.relative_to(root).as_posix(): sha256_of_file(p) for p in side_files(path)}
        content = {"suffix": path.suffix.lower(), "sha256": sha256_of_file(path), "side_files": sides}
    if item.given is not None:
        content = {"mesh": content, "given": sha256_of_file(Path(item.given))}
    identity = {"content": content, "name": item.name, "units": item.units, "up": item.up}
    return sha256_of_json(identity)[:ID_DIGITS]
