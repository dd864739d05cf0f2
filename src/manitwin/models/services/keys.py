"""Keys of services: from the environment, sent to the service and nowhere else."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from urllib.parse import urlsplit

from manitwin.errors import ConfigError, choose_from

ADDRESS = re.compile(r"(?:^|@)([A-Za-z][A-Za-z0-9+.-]*://.*)$")
SCHEMES = ("http", "https", "tcp")
_EXAMPLE = "one such as http://localhost:8000/v1, or tcp://localhost:5556 of a grasp server"
HOST = re.compile(r"[\w.:%-]+")  # names, also of other alphabets, and IPv4 and IPv6 addresses
LOCAL_HOSTS = frozenset({"localhost", "127.0.0.1", "::1"})


def is_local(url: str) -> bool:
    """Tell whether a server is on this machine: it needs no key, and costs nothing."""
    return urlsplit(url).hostname in LOCAL_HOSTS


def split_url(argument: str) -> tuple[str, str | None]:
    """Return what stands before ``@scheme://`` and the URL, each possibly missing; raises ConfigError for a bad URL."""
    found = ADDRESS.search(argument)
    return (argument, None) if found is None else (argument[: found.start()], _checked(found.group(1)))


def _checked(url: str) -> str:
    if "@" in url.partition("://")[2].partition("/")[0]:  # first of all: what comes after shows the URL
        raise ConfigError("a server's URL holds a user name or password; keys come from the environment only")
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", parts.port
    except ValueError as error:
        raise ConfigError(f"{url!r} is no URL of a server ({error}); give {_EXAMPLE}") from error
    if parts.scheme not in SCHEMES:
        raise ConfigError(f"{url!r}: {choose_from('scheme', parts.scheme, SCHEMES)}")
    if not HOST.fullmatch(host) or port == 0 or any(letter.isspace() for letter in url):
        raise ConfigError(f"{url!r} is no URL of a server; give {_EXAMPLE}")
    return url.rstrip("/")


def key_from_environment(names: Sequence[str], url: str, what: str) -> str | None:
    """Return the first key that is set; None for a server on this machine without one.

    Raises ConfigError naming the variables where a key is missing.
    """
    for name in names:
        if os.environ.get(name):
            return os.environ[name]
    if is_local(url):
        return None
    raise ConfigError(f"{what} needs a key: set {' or '.join(names)} in the environment")


def bearer(key: str | None) -> dict[str, str]:
    """Return the header that most services take a key in; none without a key."""
    return {"Authorization": f"Bearer {key}"} if key else {}


def redacted(text: str, key: str | None) -> str:
    """Return one line of at most 300 characters in which the key does not appear."""
    line = " ".join(text.split())
    return (line.replace(key, "***") if key else line)[:300]
