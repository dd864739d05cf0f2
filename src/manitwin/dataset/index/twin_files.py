"""Some files of a twin on this machine, wherever its data set lives."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from manitwin.twin.dataset_root import DatasetRoot, twin_name


@contextmanager
def local_files(root: DatasetRoot, twin_id: str, files: Iterable[str]) -> Iterator[Path]:
    """Give a folder with those of a twin's files that are there: its own, or for a URL a copy that ends with the context."""
    name = twin_name(twin_id)
    if root.local is not None:
        yield root.local / name
        return
    with tempfile.TemporaryDirectory(prefix="manitwin-") as scratch:
        folder = Path(scratch) / twin_id
        folder.mkdir()
        for file in files:
            if root.exists(f"{name}/{file}"):  # who reads the folder says what is missing
                root.fetch_file(f"{name}/{file}", folder / file)
        yield folder
