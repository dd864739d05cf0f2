"""What a page sends, up to a limit."""

from __future__ import annotations

from starlette.requests import Request


async def request_body(request: Request, most_bytes: int) -> bytes:
    """Return what was sent, of which more than ``most_bytes`` is left unread: nothing then."""
    parts, size = [], 0
    async for part in request.stream():
        size += len(part)
        if size > most_bytes:
            return b""
        parts.append(part)
    return b"".join(parts)
