"""Columns of a data file as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow as pa


def arrays_of(table: pa.Table, features: dict[str, dict[str, Any]]) -> dict[str, np.ndarray]:
    """Return the columns of rows as arrays."""
    result = {}
    for name, feature in features.items():
        if feature["dtype"] == "video":
            continue
        column = table[name].combine_chunks()
        width = feature["shape"][0]
        flat = column if width == 1 else column.flatten()
        array = flat.to_numpy(zero_copy_only=False)
        result[name] = array if width == 1 else array.reshape(-1, width)
    return result
