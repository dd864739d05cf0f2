"""A small data set and its publication, made once."""

from __future__ import annotations

from pathlib import Path

import pytest
from made_twins import make_dataset

from manitwin.dataset.publish.publish import publish_dataset


@pytest.fixture(scope="session")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set whose licences are mixed. Read only."""
    return make_dataset(tmp_path_factory.mktemp("data set [of] alice") / "set")


@pytest.fixture(scope="session")
def published(dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its publication, at most two twins a shard. Read only."""
    out = tmp_path_factory.mktemp("published") / "small-set"
    publish_dataset(dataset, out, twins_per_shard=2)
    return out
