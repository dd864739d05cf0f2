"""IP addresses behind a server's name, and the check which of them may be connected to.

A link or a redirect comes from a server, so it may name an address that only this machine can reach (OWASP, "Server Side
Request Forgery Prevention Cheat Sheet"). A name is resolved once; every address is checked, and only checked addresses are
connected to.
"""

from __future__ import annotations

import socket
import threading
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv4Network, IPv6Address, IPv6Network, ip_address

# IPv4 through a translator (RFC 6052): the last 32 bits are the IPv4 address
_NAT64 = IPv6Network("64:ff9b::/96")
_LOOPBACK = ("127.0.0.1", "::1")
# protocol assignments and deprecated 6to4 relays (RFC 6890, RFC 7526), which ipaddress covers only partly
_OF_PROTOCOLS = (IPv4Network("192.0.0.0/24"), IPv4Network("192.88.99.0/24"))


class ForbiddenAddress(Exception):
    """A name resolves to an address of this machine or its network, which may not be connected to."""


class UnknownName(OSError):
    """A name has no address, or is not resolved in time."""


@dataclass(frozen=True)
class AllowedServers:
    """The servers that may be connected to: the configured one at ``host`` and ``port``, at any address, and public ones.

    With ``on_this_machine`` the configured server's name must resolve to a loopback address.
    """

    host: str
    port: int
    on_this_machine: bool = False

    def is_own(self, host: str, port: int) -> bool:
        """Tell whether host and port are those of the configured server."""
        return (host.lower(), port) == (self.host.lower(), self.port)

    def checked(self, host: str, port: int, addresses: list[str]) -> list[str]:
        """Return the addresses of a name; raises ForbiddenAddress if one of them may not be connected to."""
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
    """Tell whether an address belongs to the public internet.

    Loopback, private, shared, link-local, multicast, unspecified and reserved addresses (the registries of RFC 6890) do not,
    nor do addresses that embed such an address (NAT64), nor 6to4, which is no longer in use (RFC 7526).
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
    """Return the addresses of a name in the system's order; raises UnknownName.

    The system's resolver has no time limit, so it runs in a thread that is abandoned if it does not answer in time.
    ``localhost`` is this machine even if the system cannot resolve it (RFC 6761, section 6.3; e.g. without /etc/hosts).
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
