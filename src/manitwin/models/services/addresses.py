"""Addresses behind a server's name, and which of them may be connected to.

A link or a redirect comes from a server, so it may name what only this machine can reach (OWASP, "Server Side Request Forgery
Prevention Cheat Sheet"). A name is looked up once; every address that it has is checked, and only those are connected to.
"""

from __future__ import annotations

import socket
import threading
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv4Network, IPv6Address, IPv6Network, ip_address

# of IPv4 through a translator (RFC 6052): the last 32 bits are the address that is reached
_NAT64 = IPv6Network("64:ff9b::/96")
_LOOPBACK = ("127.0.0.1", "::1")
# for protocols, and for relays of 6to4, which are no more (RFC 6890, RFC 7526): ipaddress knows them in parts
_OF_PROTOCOLS = (IPv4Network("192.0.0.0/24"), IPv4Network("192.88.99.0/24"))


class ForbiddenAddress(Exception):
    """A name that leads where nobody but this machine, or its network, may go."""


class UnknownName(OSError):
    """A name without an address, or one that is not found in time."""


@dataclass(frozen=True)
class Reach:
    """The servers that may be connected to: the one at ``host`` and ``port``, wherever that is, and public ones.

    ``on_this_machine``: its name has to be a loopback address, as it says.
    """

    host: str
    port: int
    on_this_machine: bool = False

    def is_own(self, host: str, port: int) -> bool:
        """Tell whether this is the server that was configured."""
        return (host.lower(), port) == (self.host.lower(), self.port)

    def checked(self, host: str, port: int, addresses: list[str]) -> list[str]:
        """Return the addresses of a name; raises ForbiddenAddress where one of them may not be connected to."""
        for address in addresses:
            if self.is_own(host, port):
                if self.on_this_machine and not ip_address(_without_zone(address)).is_loopback:
                    raise ForbiddenAddress(f"{host} is {address} here, which is not this machine")
            elif not is_public(address):
                raise ForbiddenAddress(
                    f"{host}:{port} is {address}, which is neither a public address nor its own server"
                )
        return addresses


def is_public(address: str) -> bool:
    """Tell whether an address is one of the public internet.

    Not loopback, private, shared, link-local, multicast, unspecified or reserved (the registries of RFC 6890), nor one that
    carries such an address inside (NAT64; 6to4 is no longer in use, RFC 7526).
    """
    ip = ip_address(_without_zone(address))
    if isinstance(ip, IPv6Address):
        if ip in _NAT64:
            return _is_public(IPv4Address(int(ip) & 0xFFFFFFFF))
        if ip.sixtofour is not None or ip.is_site_local:
            return False
    return _is_public(ip)


def _is_public(ip: IPv4Address | IPv6Address) -> bool:
    if any(ip in network for network in _OF_PROTOCOLS):
        return False
    return ip.is_global and not (ip.is_multicast or ip.is_reserved or ip.is_unspecified or ip.is_link_local)


def _without_zone(address: str) -> str:
    return address.partition("%")[0]


def addresses_of(host: str, port: int, timeout_s: float) -> list[str]:
    """Return the addresses of a name, in the order of the system; raises UnknownName.

    The system's own resolver has no time limit: it is asked in a thread, which is left behind where it does not answer.
    ``localhost`` is this machine even where the system does not know it (RFC 6761, section 6.3: a machine without /etc/hosts).
    """
    found: list[str] = []
    why: list[str] = ["no answer from the name service"]

    def look_up() -> None:
        try:
            answers = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        except (OSError, UnicodeError) as error:
            why[0] = str(getattr(error, "strerror", None) or error)
        else:
            found.extend(dict.fromkeys(str(answer[4][0]) for answer in answers))

    thread = threading.Thread(target=look_up, daemon=True)
    thread.start()
    thread.join(timeout_s)
    if not found and _is_localhost(host):
        return list(_LOOPBACK)
    if not found:
        raise UnknownName(f"the host name {host} cannot be resolved: {why[0]}")
    return list(found)


def _is_localhost(host: str) -> bool:
    name = host.lower().rstrip(".")
    return name == "localhost" or name.endswith(".localhost")
