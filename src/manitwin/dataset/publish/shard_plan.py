"""Shard planning: twins are grouped by category in id order, within a size limit and the hub's limits, by their listed file
sizes.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from hashlib import sha256
from pathlib import PurePosixPath

from manitwin.errors import UsageError
from manitwin.twin.dataset_root import TWINS, DatasetRoot
from manitwin.twin.store import RECORD, sha256_of_json

HUB_FILES = 100_000
HUB_FOLDER_ENTRIES = 10_000
HUB_FILE_BYTES = 20 * 10**9
"""Recommended limits of a repository: https://huggingface.co/docs/hub/repositories-recommendations"""

CATEGORY_FOLDERS = 5_000
"""Number of categories, largest first, with a folder of their own: half of the hub's limit on entries of one folder."""

VIEWS = "views"
SHARED_FOLDER = "various"
DATA = "data"
SHARD_FORMAT = 1
"""Increased when the members of a shard change, which invalidates the shards of older publications."""

TAR_BLOCK = 512
TAR_RECORD = 10_240
"""POSIX ustar: members start at block boundaries, an archive ends at a record boundary (``tarfile.RECORDSIZE``)."""

_SLUG_LENGTH = 64

_END_OF_ZIP = 22  # bytes of the end-of-central-directory record (APPNOTE.TXT 4.3.16)


@dataclass(frozen=True)
class ShardTwin:
    """A twin to publish; ``tar_bytes`` is an upper bound of the size of its members, headers included.

    ``costs`` (seconds, CPU seconds, dollars) represent its run.json, which its revision does not cover.
    """

    twin_id: str
    revision: str
    category: str
    tar_bytes: int
    costs: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Shard:
    """A tar file and its twins, sorted by id."""

    name: str
    twins: tuple[ShardTwin, ...]

    @property
    def tar_bytes(self) -> int:
        """Upper bound of the file size."""
        return archive_bytes(sum(twin.tar_bytes for twin in self.twins))

    @property
    def contents_sha256(self) -> str:
        """Digest of the planned contents; equal digests mean equal bytes."""
        return sha256_of_json([SHARD_FORMAT, [(twin.twin_id, twin.revision, twin.costs) for twin in self.twins]])


def member_bytes(size: int) -> int:
    """Return the size of a file in a tar archive: its header and whole blocks."""
    return TAR_BLOCK + -(-size // TAR_BLOCK) * TAR_BLOCK


def archive_bytes(members: int) -> int:
    """Return the size of a tar archive with members of a total size: two empty blocks are added, then padding to
    whole records.
    """
    return -(-(members + 2 * TAR_BLOCK) // TAR_RECORD) * TAR_RECORD


def category_slug(category: str) -> str:
    """Return a category as a folder name: lower-case ASCII letters, digits and single hyphens, at most 64 characters.

    A category without any such character is named by its digest. Different spellings of one name share a folder.
    """
    ascii_only = unicodedata.normalize("NFKD", category).encode("ascii", "ignore").decode().lower()
    slug = re.sub(r"[^a-z0-9]+", "-", ascii_only).strip("-")[:_SLUG_LENGTH].rstrip("-")
    return slug or f"category-{sha256(category.encode()).hexdigest()[:8]}"


def plan_shards(twins: Iterable[ShardTwin], *, max_bytes: int, max_twins: int | None = None) -> list[Shard]:
    """Return the shards of all twins, sorted by name.

    Each category has its own shards, so that single categories can be downloaded. Categories beyond the ``CATEGORY_FOLDERS``
    largest share the folder ``various``. A shard is at most ``max_bytes`` large, unless a single twin is larger. Raises
    UsageError if the hub's limits would be exceeded.
    """
    by_folder: dict[str, list[ShardTwin]] = {}
    for twin in sorted(twins, key=lambda twin: twin.twin_id):
        by_folder.setdefault(category_slug(twin.category), []).append(twin)
    largest_first = sorted(by_folder, key=lambda slug: (-len(by_folder[slug]), slug))
    for slug in largest_first[CATEGORY_FOLDERS:]:
        if slug != SHARED_FOLDER:
            by_folder.setdefault(SHARED_FOLDER, []).extend(by_folder.pop(slug))
    shards = []
    for slug, members in sorted(by_folder.items()):
        members.sort(key=lambda twin: twin.twin_id)
        for number, group in enumerate(_groups(members, max_bytes, max_twins)):
            shards.append(Shard(f"{DATA}/{slug}/{slug}-{number:06d}.tar", tuple(group)))
    check_hub_limits({shard.name: shard.tar_bytes for shard in shards})
    return shards


def _groups(twins: list[ShardTwin], max_bytes: int, max_twins: int | None) -> Iterable[list[ShardTwin]]:
    group: list[ShardTwin] = []
    held = 0
    for twin in twins:
        full = archive_bytes(held + twin.tar_bytes) > max_bytes or len(group) == max_twins
        if group and full:
            yield group
            group, held = [], 0
        group.append(twin)
        held += twin.tar_bytes
    if group:
        yield group


def check_hub_limits(sizes: dict[str, int]) -> None:
    """Raise UsageError if files of these names and sizes exceed the hub's limits on number or size."""
    if len(sizes) >= HUB_FILES:
        raise UsageError(
            f"{len(sizes):,} files, but the hub allows fewer than {HUB_FILES:,}; give a larger --shard-size-mb"
        )
    entries: Counter[PurePosixPath] = Counter()
    for path in {parent for name in sizes for parent in (PurePosixPath(name), *PurePosixPath(name).parents[:-1])}:
        entries[path.parent] += 1
    fullest, count = max(entries.items(), key=lambda item: item[1], default=(PurePosixPath(), 0))
    if count >= HUB_FOLDER_ENTRIES:
        raise UsageError(
            f"{count:,} entries in {fullest}/, but the hub allows fewer than {HUB_FOLDER_ENTRIES:,}; "
            "give a larger --shard-size-mb or --twins-per-shard"
        )
    largest = max(sizes, key=lambda name: sizes[name], default="")
    if largest and sizes[largest] >= HUB_FILE_BYTES:
        raise UsageError(
            f"{largest}: {sizes[largest]:,} bytes, but the hub only allows files below {HUB_FILE_BYTES:,}; "
            "give a smaller --shard-size-mb"
        )


def tar_bytes_of_twins(root: DatasetRoot) -> dict[str, int]:
    """Return an upper bound of the size of each finished twin in a tar archive, by id.

    An entry of a ZIP archive takes less space than the tar header that is counted for it. Raises UsageError if there are no
    twins.
    """
    root.fs.invalidate_cache()
    if root.flat:
        return _sizes_below(root, root.path)
    top = root.full(TWINS)
    if not root.fs.isdir(top):
        raise UsageError(f"{root.url}: no {TWINS}/ below it; give a data set that manitwin build made")
    sizes: dict[str, int] = {}
    for prefix in sorted(root.fs.ls(top, detail=False)):
        sizes |= _sizes_below(root, str(prefix))
    return sizes


def _sizes_below(root: DatasetRoot, prefix: str) -> dict[str, int]:
    sizes: dict[str, int] = {}
    archives: set[tuple[str, str]] = set()
    finished: set[str] = set()
    for path, info in root.fs.find(prefix, detail=True).items():
        twin_id, *file = PurePosixPath(str(path).removeprefix(prefix.rstrip("/") + "/")).parts
        sizes[twin_id] = sizes.get(twin_id, 0) + member_bytes(info["size"])
        if file == [RECORD]:
            finished.add(twin_id)
        if len(file) > 1 and file[0] != VIEWS:
            archives.add((twin_id, file[0]))
    for twin_id, _ in archives:
        sizes[twin_id] += member_bytes(_END_OF_ZIP)
    return {twin_id: size for twin_id, size in sizes.items() if twin_id in finished}
