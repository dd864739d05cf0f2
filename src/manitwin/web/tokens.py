"""One-time links and session secrets, in memory or stored in a file that outlives the server."""

from __future__ import annotations

import hashlib
import hmac
import json
import os
import secrets
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from manitwin.errors import UsageError
from manitwin.formats.json_file import read_json_object
from manitwin.twin.store import atomic_file

MOST_LINKS = 64
"""Maximum number of unused links per person; the oldest are discarded."""
LASTING_S = 30 * 24 * 3600.0
"""Validity of stored links and cookies in seconds."""
_MOST_BYTES, _MOST_ENTRIES = 8 << 20, 20_000
_REMEDY = "remove it: everybody who reviews then gets a new link"


class _Entry(BaseModel):
    model_config = ConfigDict(extra="forbid")

    person: str = Field(max_length=200)
    at: float = Field(ge=0, allow_inf_nan=False)


class _Content(BaseModel):
    """Valid links and sessions, stored only as SHA-256 digests of link tokens and cookie secrets."""

    model_config = ConfigDict(extra="forbid")

    port: int | None = Field(default=None, ge=1, le=65535)
    links: dict[str, _Entry] = Field(default_factory=dict, max_length=_MOST_ENTRIES)
    cookies: dict[str, _Entry] = Field(default_factory=dict, max_length=_MOST_ENTRIES)


@dataclass(frozen=True)
class AccessFile:
    """A file readable by its owner only, from which a restarted server restores sessions and port."""

    path: Path

    def read(self) -> dict[str, Any]:
        """Return the content, empty if the file is missing; raises UsageError for an invalid file."""
        if not os.path.lexists(self.path):
            return _Content().model_dump()
        said = read_json_object(
            self.path, UsageError, limit_bytes=_MOST_BYTES, inside=self.path.parent, name=str(self.path), remedy=_REMEDY
        )
        try:
            return _Content.model_validate(said).model_dump()
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"]))
            raise UsageError(f"{self.path}: {where}: {first['msg']}; {_REMEDY}") from error

    def write(self, content: Mapping[str, Any]) -> None:
        """Replace the content."""
        with atomic_file(self.path) as beside:
            os.close(os.open(beside, os.O_CREAT | os.O_WRONLY | os.O_TRUNC, 0o600))
            beside.write_text(json.dumps(content))


class Tokens:
    """Valid links and sessions of persons, identified by any name.

    With a file, unused links and session secrets stay valid for ``LASTING_S``, also in another process; otherwise both end with
    this process.
    """

    def __init__(self, kept: AccessFile | None = None, now: Callable[[], float] = time.time):
        self._kept, self._now = kept, now
        self._content: dict[str, Any] = _Content().model_dump() if kept is None else kept.read()
        self.lasting_s = None if kept is None else LASTING_S
        for entries in (self._content["links"], self._content["cookies"]):
            for digest in [digest for digest, entry in entries.items() if self._is_expired(entry)]:
                del entries[digest]

    @property
    def port(self) -> int | None:
        """The port of the previous server."""
        port: int | None = self._content["port"]
        return port

    def record_port(self, port: int) -> None:
        """Record the port of this server; cookies are specific to it."""
        self._content["port"] = port
        self._write()

    def revoke_all(self) -> None:
        """Revoke all links and sessions."""
        self._content |= {"links": {}, "cookies": {}}
        self._write()

    def link(self, person: str = "") -> str:
        """Return the token of a new link for a person."""
        token, links = secrets.token_urlsafe(32), self._content["links"]
        links[_digest(token)] = {"person": person, "at": self._now()}
        theirs = [digest for digest, entry in links.items() if entry["person"] == person]
        for digest in sorted(theirs, key=lambda each: links[each]["at"])[
            :-MOST_LINKS
        ]:  # stable sort: in order of creation
            del links[digest]
        self._write()
        return token

    def redeem(self, token: str) -> str | None:
        """Exchange a link's token for a session secret and invalidate the link; None for an invalid token."""
        found = self._find(token, "links")
        if found is None:
            return None
        person, secret = self._content["links"].pop(found)["person"], secrets.token_urlsafe(32)
        self._content["cookies"][_digest(secret)] = {"person": person, "at": self._now()}
        self._write()
        return secret

    def person(self, secret: str) -> str | None:
        """Return the person with this session secret, or None."""
        found = self._find(secret, "cookies")
        return None if found is None else str(self._content["cookies"][found]["person"])

    def _find(self, given: str, kind: str) -> str | None:
        """Return the stored digest of a token or secret; comparisons take constant time."""
        wanted, found = _digest(given), None
        for digest, entry in self._content[kind].items():
            if hmac.compare_digest(wanted, digest) and not self._is_expired(entry):
                found = digest
        return found

    def _is_expired(self, entry: Mapping[str, Any]) -> bool:
        return self.lasting_s is not None and self._now() - float(entry["at"]) > self.lasting_s

    def _write(self) -> None:
        if self._kept is not None:
            self._kept.write(self._content)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode(errors="replace")).hexdigest()
