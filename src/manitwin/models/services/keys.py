"""API keys: read from the environment, and sent only to their service."""

from __future__ import annotations

import base64
import html
import os
import re
from collections.abc import Sequence
from functools import lru_cache
from urllib.parse import urlsplit

from manitwin.errors import ConfigError, unknown_name_message
from manitwin.formats.printable import printable_line

ADDRESS = re.compile(r"(?:^|@)([A-Za-z][A-Za-z0-9+.-]*://.*)$")
_BARE_HOST = re.compile(r"@((?:localhost|\d{1,3}(?:\.\d{1,3}){3}|[\w-]+(?:\.[\w-]+)*:\d+)(?:[:/].*)?)$")
"""A server's address without scheme, which would otherwise be taken for part of a model name."""
SCHEMES = ("http", "https", "tcp")
_EXAMPLE = "one such as http://localhost:8000/v1, or tcp://localhost:5556 of a grasp server"
HOST = re.compile(r"[\w.:%-]+")  # names in any alphabet, and IPv4 and IPv6 addresses
LOCAL_HOSTS = frozenset({"localhost", "127.0.0.1", "::1"})
"""Accepted names of the loopback interface; others (127.0.0.2, 2130706433, localhost.example) are not accepted."""
MESSAGE_CHARACTERS = 300
TELLING_CHARACTERS = 16  # a shorter key may be a word ("none", "rehearsal-key") that answers contain by chance
_READ_CHARACTERS = 10_000  # characters of a server message that are searched for the key


def is_local(url: str) -> bool:
    """Tell whether a server is on this machine, so that it needs no key and costs nothing."""
    return urlsplit(url).hostname in LOCAL_HOSTS


def split_url(argument: str) -> tuple[str, str | None]:
    """Split an argument into the part before ``@scheme://`` and the URL, both optional; raises ConfigError for an invalid URL."""
    found = ADDRESS.search(argument)
    if found is None and (bare := _BARE_HOST.search(argument)) is not None:
        raise ConfigError(f"{bare[1]!r} is not the URL of a server; give its scheme too, such as http://{bare[1]}")
    return (argument, None) if found is None else (argument[: found.start()], _checked(found.group(1)))


def _checked(url: str) -> str:
    """Return a URL without trailing slash; raises ConfigError for an invalid one, without showing credentials."""
    if "@" in url.partition("://")[2].partition("/")[0]:  # checked first, because later messages show the URL
        raise ConfigError("the URL of a server contains a user name or password; pass keys in the environment only")
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", parts.port
    except ValueError as error:
        raise ConfigError(f"{url!r} is not the URL of a server ({error}); give {_EXAMPLE}") from error
    if parts.scheme not in SCHEMES:
        raise ConfigError(f"{url!r}: {unknown_name_message('scheme', parts.scheme, SCHEMES)}")
    if not HOST.fullmatch(host) or port == 0 or any(letter.isspace() for letter in url):
        raise ConfigError(f"{url!r} is not the URL of a server; give {_EXAMPLE}")
    if parts.query or parts.fragment:
        raise ConfigError(
            f"the URL of {host} contains a query or a fragment; remove it, and pass keys in the environment only"
        )
    return url.rstrip("/")


def key_from_environment(names: Sequence[str], url: str, what: str, *, own_server: bool = False) -> str | None:
    """Return the first key that is set, after checking that it may be sent to ``url``.

    Returns None without a key for a server on this machine, and for the user's own server (``own_server``) at a plain http
    address, where a key could not be sent. Otherwise raises ConfigError, naming the variables, if the key is missing or may
    not be sent.
    """
    for name in names:
        if os.environ.get(name):
            check_key(os.environ[name], url, name)
            return os.environ[name]
    if is_local(url) or (own_server and urlsplit(url).scheme == "http"):
        return None
    raise ConfigError(f"{what} needs a key: set {' or '.join(names)} in the environment")


def check_key(key: str | None, url: str, name: str) -> None:
    """Check a key and its destination: keys are sent over https only, or to this machine by its own name.

    Raises ConfigError, which does not show the key; ``name`` is the name of the key or its service.
    """
    if key is None:
        return
    if not (key.isascii() and key.isprintable() and " " not in key):
        raise ConfigError(f"{name} contains spaces or characters that are invalid in a key; copy it again")
    if urlsplit(url).scheme != "https" and not is_local(url):
        raise ConfigError(
            f"{name}: a key is sent over https only, or to this machine ({', '.join(sorted(LOCAL_HOSTS))}); {url} is"
            " neither. Give an https:// address, or unset the key for a server that needs none"
        )


def bearer(key: str | None) -> dict[str, str]:
    """Return the Authorization header with the key as bearer token; no header without a key."""
    return {"Authorization": f"Bearer {key}"} if key else {}


def redacted(text: str, key: str | None) -> str:
    """Return a server's message as one line of at most 300 characters, without the key and without control characters.

    A longer message is truncated and ends with three dots.
    """
    line = " ".join(text[:_READ_CHARACTERS].split())
    line = printable_line(_spelled(key).sub("***", line) if key else line)
    return line if len(line) <= MESSAGE_CHARACTERS else f"{line[: MESSAGE_CHARACTERS - 3]}..."


def without_key(text: str, key: str | None) -> str:
    """Return a text of any length without the key, unless the key is so short that it may be a word."""
    return _spelled(key).sub("***", text) if key and len(key) >= TELLING_CHARACTERS else text


@lru_cache(maxsize=8)
def _spelled(key: str) -> re.Pattern[str]:
    """Return a pattern that matches a key verbatim or escaped for URLs, HTML, JSON (also nested) or base64, in any case."""
    each = "".join(rf"(?:{re.escape(c)}|%{ord(c):02x}|\\{{1,8}}u00{ord(c):02x}|\\{{1,8}}{re.escape(c)})" for c in key)
    whole = {html.escape(key), base64.b64encode(key.encode()).decode().rstrip("=")}
    return re.compile("|".join([each, *map(re.escape, sorted(whole))]), re.IGNORECASE)
