"""Data sets in Python: lazy filtering, splitting, iteration and batching over the index."""

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

if TYPE_CHECKING:  # SAPIEN and the mesh libraries are imported only when a twin is loaded
    from manitwin.twin.loaded_twin import Twin

_HASH_DIGITS = 16
_FEW = 1000


class Split(NamedTuple):
    """Train, validation and test data sets that share no object."""

    train: Dataset
    val: Dataset
    test: Dataset


class Dataset(Sequence["Twin"]):
    """The accepted twins of a data set (folder or URL), optionally filtered by conditions: a sequence sorted by id.

    Queries are answered from the index. Twin folders are read only when a record or twin is requested: ``dataset[0]`` loads one
    twin, a slice loads none until it is indexed. Raises UsageError if there is no index, and at the first query if a condition or
    column is invalid or exceeds ``timeout_s`` or ``memory_gb``. Raises IndexError for positions out of range.
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
        return _unpickle, (self._index, self._where)

    @property
    def root(self) -> DatasetRoot:
        """The folder or URL of the data set."""
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
        """Return the position of a twin, given as a loaded twin or an id; raises ValueError if it is not in the data set."""
        return self.twins().index(twin, start, stop)

    def count(self, twin: Any) -> int:
        """Return how often a twin, given as a loaded twin or an id, occurs: 1 or 0."""
        return self.twins().count(twin)

    def filter(self, where: str) -> Dataset:
        """Return the twins that also satisfy an SQL condition on table ``twins``: ``"category = 'mug' and verified >= 20"``."""
        return Dataset(self.root, _index=self._index, _where=(*self._where, where))

    def ids(self) -> list[str]:
        """Return the sorted twin ids."""
        return self.twins().ids()

    def records(self) -> Iterator[TwinRecord]:
        """Yield the record (twin.json) of each twin; raises TwinError for one that cannot be read."""
        for twin_id in self.ids():
            with local_files(self.root, twin_id, (RECORD,)) as folder:
                yield read_record(folder)

    def twins(self) -> Twins:
        """Return the twins as a sequence that ignores later changes of the index; each twin is loaded on access."""
        if self._sorted is None or self._sorted[0] is not self._index.parts:
            ids: list[str] = self.table(["twin_id"])["twin_id"].to_pylist()
            self._sorted = (self._index.parts, Twins(self.root, ids))
        return self._sorted[1]

    def table(self, columns: Sequence[str] | None = None) -> pa.Table:
        """Return columns of the table ``twins`` (all by default), one row per twin."""
        return self._index.select("twins", self._where, columns=columns)

    def grasps(self, where: str | None = None, columns: Sequence[str] | None = None) -> pa.Table:
        """Return rows of the table ``grasps`` for these twins, all of them or those that satisfy an SQL condition.

        All rows of ``grasps.parquet`` are included: failed grasps, other grippers' grasps, the unfiltered sample (``proposer``
        ends in ``:unfiltered``) and the jittered controls (``:jittered``).
        """
        return self._index.select(
            "grasps", [*self._grasp_conditions(), *([] if where is None else [where])], columns=columns
        )

    def _grasp_conditions(self) -> list[str]:
        """Return the conditions on ``grasps`` that select these twins: their ids if they are few, else a subquery."""
        if not self._where:
            return []
        twins = self.table(["twin_id", "category"])
        if 0 < len(twins) <= _FEW:
            return grasps_of(twins)
        return [f"twin_id IN (SELECT twin_id FROM twins {self._index.where(self._where)})"]

    def split(self, train: float = 0.8, val: float = 0.1, test: float = 0.1, *, seed: int = 0) -> Split:
        """Split the data set by object into fixed parts: the part of a twin depends only on the seed and the bytes of its input.

        Twins of one input are in one part, and a growing data set never moves a twin. Shares are therefore met on average: with n
        twins, the size of a part deviates by about sqrt(n). Shares may sum to less than 1; other invalid shares raise UsageError.
        The hash is the first 64 bits of sha256("<seed>:<source_sha256>") as a fraction of 2^64: below ``train`` is the training
        part, below ``train + val`` the validation part, and so on.
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
        """Yield all twins once in an order given by the seed, ``size`` at a time (the last batch may be smaller).

        See ``index.batches.batches`` for the content of a batch and the errors raised.
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


def _unpickle(index: Index, where: tuple[str, ...]) -> Dataset:
    return Dataset(index.root, _index=index, _where=where)


def _hash_bound(share: float) -> str:
    """Return the smallest hex prefix that is not below a share of the hash range; for a share of 1, text that sorts after all
    digits.
    """
    whole = 16**_HASH_DIGITS
    bound = round(min(share, 1.0) * whole)
    return f"{bound:0{_HASH_DIGITS}x}" if bound < whole else "g"
