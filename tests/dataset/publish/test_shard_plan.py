from __future__ import annotations

import time
from collections import Counter

import numpy as np
import pytest

from manitwin.dataset.publish.shard_plan import (
    HUB_FILES,
    HUB_FOLDER_ENTRIES,
    ShardTwin,
    archive_bytes,
    category_slug,
    check_hub_limits,
    plan_shards,
)
from manitwin.errors import UsageError

MB = 10**6


def twins_of(categories: list[str], sizes: np.ndarray) -> list[ShardTwin]:
    return [
        ShardTwin(f"{number:016x}", "r", category, int(size))
        for number, (category, size) in enumerate(zip(categories, sizes, strict=True))
    ]


def entries_by_folder(names: list[str]) -> Counter[str]:
    paths = {"/".join(parts[:n]) for name in names for parts in [name.split("/")] for n in range(1, len(parts) + 1)}
    return Counter(path.rpartition("/")[0] for path in paths)


def test_hundred_thousand_twins_of_512_categories_stay_within_the_hubs_limits() -> None:
    rng = np.random.default_rng(0)
    share = 1 / np.arange(1, 513)  # few large categories, many small ones
    categories = [f"category {n}" for n in rng.choice(512, 100_000, p=share / share.sum())]
    twins = twins_of(categories, rng.lognormal(np.log(3e6), 0.6, 100_000))
    started = time.process_time()
    shards = plan_shards(twins, max_bytes=1000 * MB)
    assert time.process_time() - started < 10
    assert sum(len(shard.twins) for shard in shards) == 100_000
    assert len({twin.twin_id for shard in shards for twin in shard.twins}) == 100_000
    assert max(shard.tar_bytes for shard in shards) <= 1000 * MB
    assert 512 < len(shards) < 1000, "about one more a category than the bytes ask for"
    assert all(len({twin.category for twin in shard.twins}) == 1 for shard in shards)
    assert max(entries_by_folder([shard.name for shard in shards]).values()) < HUB_FOLDER_ENTRIES


def test_a_category_a_twin_shares_folders_only_beyond_the_limit() -> None:
    categories = [f"thing {n}" for n in range(60_000)] + ["mug"] * 40_000
    shards = plan_shards(twins_of(categories, np.full(100_000, 3 * MB)), max_bytes=1000 * MB)
    entries = entries_by_folder([shard.name for shard in shards])
    assert entries["data"] == 5_001, "the largest ones and one for all others"
    assert len(shards) < HUB_FILES and max(entries.values()) < HUB_FOLDER_ENTRIES
    mugs = [shard for shard in shards if shard.name.startswith("data/mug/")]
    assert sum(len(shard.twins) for shard in mugs) == 40_000


def test_plan_does_not_depend_on_the_order_of_the_twins() -> None:
    twins = twins_of(["mug", "bowl", "cup"] * 20, np.arange(60) * MB)
    assert plan_shards(twins, max_bytes=200 * MB) == plan_shards(twins[::-1], max_bytes=200 * MB)


def test_a_twin_larger_than_a_shard_gets_one_of_its_own() -> None:
    shards = plan_shards(twins_of(["mug"] * 3, np.array([1, 5, 1]) * MB), max_bytes=2 * MB)
    assert [len(shard.twins) for shard in shards] == [1, 1, 1]
    assert [shard.name[-10:-4] for shard in shards] == ["000000", "000001", "000002"]


def test_twins_per_shard_bounds_the_number() -> None:
    shards = plan_shards(twins_of(["mug"] * 5, np.full(5, 1000)), max_bytes=2 * MB, max_twins=2)
    assert [len(shard.twins) for shard in shards] == [2, 2, 1]


def test_contents_digest_follows_revision_and_costs() -> None:
    def digest(**change: object) -> str:
        twin = {"twin_id": "a", "revision": "r", "category": "mug", "tar_bytes": 1, **change}
        return plan_shards([ShardTwin(**twin)], max_bytes=MB)[0].contents_sha256

    digests = [digest(), digest(), digest(revision="s"), digest(costs=(1.0, 0.0, 0.0))]
    assert digests[0] == digests[1] and len(set(digests)) == 3


def test_too_many_files_are_refused_with_the_remedy() -> None:
    with pytest.raises(UsageError, match=r"100,000 files.*--shard-size-mb"):
        check_hub_limits({f"data/{n // 1000}/{n}.tar": 1 for n in range(100_000)})
    with pytest.raises(UsageError, match=r"10,000 entries in data/mug/"):
        plan_shards(twins_of(["mug"] * 10_000, np.full(10_000, 1000)), max_bytes=MB, max_twins=1)
    with pytest.raises(UsageError, match="20,000,000,000 bytes"):
        check_hub_limits({"data/mug/mug-000000.tar": 20 * 10**9})


@pytest.mark.parametrize(
    ("category", "slug"),
    [
        ("Salt shaker", "salt-shaker"),
        ("café/../mug", "cafe-mug"),
        ("..", "category-"),
        ("杯", "category-"),
        ("x" * 99, "x" * 64),
    ],
)
def test_category_is_a_safe_folder_name(category: str, slug: str) -> None:
    found = category_slug(category)
    assert found == slug if not slug.endswith("-") else found.startswith(slug) and len(found) == len(slug) + 8


def test_archive_size_is_that_of_a_tar() -> None:
    import io
    import tarfile

    for size in (0, 1, 512, 9000, 10_240):
        stream = io.BytesIO()
        with tarfile.open(fileobj=stream, mode="w") as tar:
            member = tarfile.TarInfo("a.b")
            member.size = size
            tar.addfile(member, io.BytesIO(bytes(size)))
        assert len(stream.getvalue()) == archive_bytes(512 + -(-size // 512) * 512)
