"""JSON that others wrote: bounded, every number finite."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.errors import AssetError
from manitwin.formats.xml_file import MAX_NUMBER

MAX_JSON_BYTES = 64 << 20


def parse_json(path: Path) -> dict[str, Any]:
    """Read a file that holds one JSON object; raises AssetError naming the file and what is wrong with it."""
    try:
        if path.stat().st_size > MAX_JSON_BYTES:
            raise AssetError(f"{path.name}: more than {MAX_JSON_BYTES >> 20} MiB of JSON; it is of no single object")
        value = json.loads(path.read_bytes())
    except OSError as error:
        raise AssetError(f"{path.name}: {error.strerror or error}; check the path") from error
    except (ValueError, RecursionError) as error:
        raise AssetError(f"{path.name}: its JSON is broken ({' '.join(str(error).split())[:80]}); mend it") from error
    if not isinstance(value, dict):
        raise AssetError(f"{path.name}: holds a JSON {type(value).__name__}, not an object")
    return value


def json_number(value: Any, what: str) -> float:
    """Return a finite number; raises AssetError saying ``what`` it is of."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise AssetError(f"{what}: {str(value)[:40]!r} is no number")
    if not math.isfinite(value) or abs(value) > MAX_NUMBER:
        raise AssetError(f"{what}: {value:.3g} is no number that an object can have")
    return float(value)


def json_vector(value: Any, count: int, what: str) -> np.ndarray:
    """Return exactly ``count`` finite numbers ``(count,)``; raises AssetError saying ``what`` they are of."""
    if not isinstance(value, list) or len(value) != count:
        raise AssetError(f"{what}: {str(value)[:40]!r} are not {count} numbers")
    return np.array([json_number(entry, what) for entry in value])


def json_object(value: Any, what: str) -> dict[str, Any]:
    """Return a JSON object, an empty one for None; raises AssetError saying ``what`` it is of."""
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise AssetError(f"{what}: {str(value)[:40]!r} is no JSON object")
    return value
