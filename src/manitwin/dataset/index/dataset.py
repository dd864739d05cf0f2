"""A data set from Python: filtered, split, iterated and batched, reading nothing before it is asked for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, SupportsIndex, overload

import pyarrow as pa

from manitwin.dataset.index.part_list import PartList
from manitwin.dataset.index.query import MEMORY_GB, TIMEOUT_S, Index, grasps_of
from manitwin.dataset.index.twins import Twins, local_files
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import RECORD, read_record

if TYPE_CHECKING:  # SAPIEN and meshes are imported when a twin is loaded
    from manitwin.twin.loaded_twin import Twin

_HASH_DIGITS = 16
_FEW = 1000


class Split(NamedTuple):
    """Three data sets that share no object."""

    train: Dataset
    val: Dataset
    test: Dataset


class Dataset(Sequence["Twin"]):
    """The accepted twins of a data set, a folder or a URL, or those of them that satisfy conditions: a sequence sorted by id.

    Answers come from the index; twins' folders are read when a record or twin is asked for, ``dataset[0]`` loads one, and a
    slice is a sequence that loads none before it is asked. Raises UsageError where there is no index, and, when it is first
    asked, for conditions and columns that cannot be used, or take more than ``timeout_s`` or ``memory_gb``; IndexError for a
    place that there is not.
    """

    def __init__(
        self,
        root: str | Path | DatasetRoot,
        *,
        timeout_s: float = TIMEOUT_S,
        memory_gb: float = MEMORY_GB,
        _index: Index | None = None,
        _where: tuple[str, ...] = (),
    ):
        self._index = _index or Index(root, timeout_s=timeout_s, memory_gb=memory_gb)
        self._where = _where
        self._sorted: tuple[PartList, Twins] | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self._index, self._where)

    @property
    def root(self) -> DatasetRoot:
        """The folder or URL that it lives at."""
        return self._index.root

    def __repr__(self) -> str:
        return f"Dataset({self.root.url!r}{''.join(f', {condition!r}' for condition in self._where)})"

    def __len__(self) -> int:
        return self._index.count("twins", self._where)

    def __iter__(self) -> Iterator[Twin]:
        return iter(self.twins())

    @overload
    def __getitem__(self, place: SupportsIndex | str) -> Twin: ...
    @overload
    def __getitem__(self, place: slice) -> Twins: ...
    def __getitem__(self, place: SupportsIndex | str | slice) -> Twin | Twins:
        return self.twins()[place]

    def __reversed__(self) -> Iterator[Twin]:
        return reversed(self.twins())

    def __contains__(self, twin: object) -> bool:
        return twin in self.twins()

    def index(self, twin: Any, start: int = 0, stop: int | None = None) -> int:
        """Return the place of a twin, given itself or its id; raises ValueError where it is not among these."""
        return self.twins().index(twin, start, stop)

    def count(self, twin: Any) -> int:
        """Return how often a twin, given itself or its id, is among these: once or not at all."""
        return self.twins().count(twin)

    def filter(self, where: str) -> Dataset:
        """Return those that also satisfy an SQL condition on the table ``twins``: ``"category = 'mug' and verified >= 20"``."""
        return Dataset(self.root, _index=self._index, _where=(*self._where, where))

    def ids(self) -> list[str]:
        """Return the twins' ids, sorted."""
        return self.twins().ids()

    def records(self) -> Iterator[TwinRecord]:
        """Yield what twin.json says of each; raises TwinError for one that cannot be read."""
        for twin_id in self.ids():
            with local_files(self.root, twin_id, (RECORD,)) as folder:
                yield read_record(folder)

    def twins(self) -> Twins:
        """Return them as a sequence, which stays as it is when the index changes; each is loaded when it is asked for."""
        if self._sorted is None or self._sorted[0] is not self._index.parts:
            ids: list[str] = self.table(["twin_id"])["twin_id"].to_pylist()
            self._sorted = (self._index.parts, Twins(self.root, ids))
        return self._sorted[1]

    def table(self, columns: Sequence[str] | None = None) -> pa.Table:
        """Return columns of the table ``twins``, by default all, a row a twin."""
        return self._index.select("twins", self._where, columns=columns)

    def grasps(self, where: str | None = None, columns: Sequence[str] | None = None) -> pa.Table:
        """Return rows of the table ``grasps`` of these twins: all of them, or those that satisfy an SQL condition.

        That is every row of their ``grasps.parquet``: failed ones, other grippers', the unfiltered sample (``proposer`` ends
        in ``:unfiltered``) and the jittered controls (``:jittered``) too.
        """
        return self._index.select("grasps", [*self._owned(), *([] if where is None else [where])], columns=columns)

    def _owned(self) -> list[str]:
        """Return the conditions on ``grasps`` for these twins: their ids where they are few, else what chooses them."""
        if not self._where:
            return []
        twins = self.table(["twin_id", "category"])
        if 0 < len(twins) <= _FEW:
            return grasps_of(twins)
        return [f"twin_id IN (SELECT twin_id FROM twins {self._index.where(self._where)})"]

    def split(self, train: float = 0.8, val: float = 0.1, test: float = 0.1, *, seed: int = 0) -> Split:
        """Split by object, for good: where a twin belongs depends on the seed and its input's bytes alone.

        Twins of one input are in one part, and a set that grows leaves every twin where it was. The shares therefore hold on
        average: of n twins, a part's count is off by some sqrt(n). Shares may add up to less than 1; raises UsageError for
        others. The hash: the first 64 bits of sha256("<seed>:<source_sha256>"), as a share of 2^64, is below ``train``, or
        below ``train + val``, ...
        """
        shares = (train, val, test)
        if min(shares) < 0 or sum(shares) > 1 + 1e-9:
            raise UsageError(
                f"shares {train:g}, {val:g}, {test:g}: the shares must be 0 or more and add up to at most 1"
            )
        bounds = [_hash_bound(sum(shares[:count])) for count in range(4)]
        digest = f"substr(sha256('{int(seed)}:' || source_sha256), 1, {_HASH_DIGITS})"
        return Split(*(self.filter(f"{digest} >= '{low}' AND {digest} < '{high}'") for low, high in pairwise(bounds)))

    def batches(
        self,
        size: int,
        *,
        points: int = 2048,
        grasps: int = 64,
        verified_only: bool = True,
        framework: Literal["numpy", "torch"] = "numpy",
        seed: int = 0,
    ) -> Iterator[dict[str, Any]]:
        """Yield all twins once, in an order that the seed gives, ``size`` at a time (the last batch may be smaller).

        See ``index.batches`` for what a batch holds and what is raised.
        """
        from manitwin.dataset.index.batches import batches

        return batches(
            self._index,
            self.table(["twin_id", "category", "gripper"]),
            size,
            points=points,
            grasps=grasps,
            verified_only=verified_only,
            framework=framework,
            seed=seed,
        )


def _restored(index: Index, where: tuple[str, ...]) -> Dataset:
    return Dataset(index.root, _index=index, _where=where)


def _hash_bound(share: float) -> str:
    """Return the first hex digits that are not below a share of all; of 1, text that is above all digits."""
    whole = 16**_HASH_DIGITS
    bound = round(min(share, 1.0) * whole)
    return f"{bound:0{_HASH_DIGITS}x}" if bound < whole else "g"
