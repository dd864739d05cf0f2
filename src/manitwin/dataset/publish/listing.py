"""How large the finished twins of a data set are, by one listing of each of its 256 folders."""

from __future__ import annotations

from pathlib import PurePosixPath

from manitwin.dataset.publish.members import VIEWS
from manitwin.dataset.publish.shard_plan import member_bytes
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import TWINS, DatasetRoot
from manitwin.twin.store import RECORD

_END_OF_ZIP = 22  # bytes of the end-of-central-directory record (APPNOTE.TXT 4.3.16)


def tar_bytes_of_twins(root: DatasetRoot) -> dict[str, int]:
    """Return what each finished twin takes in a tar at most, by its id.

    An entry of an archive takes less than the tar header that is counted for it. Raises UsageError where there are no twins.
    """
    root.fs.invalidate_cache()
    top = root.full(TWINS)
    if not root.fs.isdir(top):
        raise UsageError(f"{root.url}: no {TWINS}/ below it; give a data set that manitwin run made")
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
