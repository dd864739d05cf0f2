"""Size-limited reading of request bodies."""

from __future__ import annotations

from starlette.requests import Request


async def request_body(request: Request, most_bytes: int) -> bytes:
    """Return the body of a request; empty if it exceeds ``most_bytes``, in which case the rest is not read."""
    parts, size = [], 0
    async for part in request.stream():
        size += len(part)
        if size > most_bytes:
            return b""
        parts.append(part)
    return b"".join(parts)
