"""HTTP transport for one request: a deadline for the whole request, checked addresses, proxies through CONNECT only."""

from __future__ import annotations

import ssl
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any
from urllib.request import getproxies, proxy_bypass

import httpcore2
import httpx2

from manitwin.errors import ConfigError
from manitwin.models.services.addresses import AllowedServers, UnknownName, addresses_of

MAX_CONNECT_S = 30.0
LONGEST_STEP_S = 86_400.0  # sockets do not accept an infinite timeout
_NO_WHOLE_ANSWER = "no whole answer within {:.4g} s"


class Deadline:
    """Time limit of a request, from resolving the name to the last byte; ``extend`` adds time."""

    def __init__(self, seconds: float, clock: Callable[[], float] = time.monotonic):
        self._clock, self.seconds = clock, seconds
        self._until = clock() + seconds

    def extend(self, seconds: float) -> None:
        """Add seconds to the time limit."""
        self.seconds += seconds
        self._until += seconds

    def left_s(self, at_most: float | None = None, over: type[Exception] = httpcore2.ReadTimeout) -> float:
        """Return the seconds left for one step, at most ``at_most``; raises ``over`` if none are left."""
        left = self._until - self._clock()
        if left <= 0:
            raise over(self.over)
        return min(left, LONGEST_STEP_S if at_most is None else at_most, LONGEST_STEP_S)

    @property
    def over(self) -> str:
        """Message for a request that exceeds the deadline."""
        return _NO_WHOLE_ANSWER.format(self.seconds)


class GuardedTransport(httpx2.BaseTransport):
    """Transport that connects only where ``reach`` allows, within ``deadline``, and uses the environment's proxy only for https.

    A proxy gets a CONNECT request, so it sees the name of the server and nothing else. Plain http bypasses proxies, so that
    no proxy reads it.
    """

    def __init__(self, reach: AllowedServers, deadline: Deadline):
        self._reach, self._deadline = reach, deadline
        self._pools: list[httpcore2.ConnectionPool] = []

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        """Send a request; raises httpx2.RequestError, and ForbiddenAddress for an address that ``reach`` does not allow."""
        with _as_httpx(self._deadline):
            pool = self._pool(request.url)
            self._pools.append(pool)
            answer = pool.handle_request(
                httpcore2.Request(
                    method=request.method,
                    url=httpcore2.URL(
                        scheme=request.url.raw_scheme,
                        host=request.url.raw_host,
                        port=request.url.port,
                        target=request.url.raw_path,
                    ),
                    headers=request.headers.raw,
                    content=request.stream,
                    extensions=request.extensions,
                )
            )
            stream = _Body(answer.stream, self._deadline)
            return httpx2.Response(answer.status, headers=answer.headers, stream=stream, extensions=answer.extensions)

    def close(self) -> None:
        """Close the connections."""
        while self._pools:
            self._pools.pop().close()

    def _pool(self, url: httpx2.URL) -> httpcore2.ConnectionPool:
        """Return a connection pool for one request, through a proxy if the environment names one for https."""
        backend = _GuardedBackend(self._reach, self._deadline)
        host, port = url.raw_host.decode(), _port_of(url)
        own = self._reach.is_own(host, port)
        proxy = None if own and self._reach.on_this_machine else proxy_for(url)
        if proxy is None:
            return httpcore2.ConnectionPool(ssl_context=_tls(), network_backend=backend)
        if not own:
            self._check_for_proxy(host, port)
        backend.reach = AllowedServers(proxy.raw_host.decode(), _port_of(proxy))
        login = (proxy.username, proxy.password) if proxy.userinfo else None
        return httpcore2.HTTPProxy(
            httpcore2.URL(scheme=proxy.raw_scheme, host=proxy.raw_host, port=proxy.port, target=b"/"),
            proxy_auth=login,
            ssl_context=_tls(),
            proxy_ssl_context=_tls() if proxy.scheme == "https" else None,
            network_backend=backend,
        )

    def _check_for_proxy(self, host: str, port: int) -> None:
        """Check the addresses of a name that a proxy will connect to, if it can be resolved here.

        Behind some proxies names cannot be resolved.
        """
        try:
            addresses = addresses_of(host, port, self._deadline.left_s(MAX_CONNECT_S, httpcore2.ConnectTimeout))
        except UnknownName:
            return
        self._reach.checked(host, port, addresses)


class _GuardedBackend(httpcore2.NetworkBackend):
    """Network backend that resolves names, checks the addresses against ``reach``, and connects within the deadline."""

    def __init__(self, reach: AllowedServers, deadline: Deadline):
        self.reach, self._deadline, self._inner = reach, deadline, httpcore2.SyncBackend()

    def connect_tcp(
        self,
        host: str,
        port: int,
        timeout: float | None = None,
        local_address: str | None = None,
        socket_options: Iterable[Any] | None = None,
    ) -> httpcore2.NetworkStream:
        try:
            addresses = addresses_of(host, port, self._deadline.left_s(timeout, httpcore2.ConnectTimeout))
        except UnknownName as error:
            raise httpcore2.ConnectError(str(error)) from None
        failure: Exception | None = None
        for address in self.reach.checked(host, port, addresses):
            try:
                left_s = self._deadline.left_s(timeout, httpcore2.ConnectTimeout)
                stream = self._inner.connect_tcp(address, port, left_s, local_address, socket_options)
            except (httpcore2.ConnectError, httpcore2.ConnectTimeout) as error:
                failure = error
            else:
                return _Stream(stream, self._deadline)
        raise failure or httpcore2.ConnectError(f"the name {host} has no address")


class _Stream(httpcore2.NetworkStream):
    """A connection whose every step ends by the deadline of the whole request."""

    def __init__(self, inner: httpcore2.NetworkStream, deadline: Deadline):
        self._inner, self._deadline = inner, deadline

    def read(self, max_bytes: int, timeout: float | None = None) -> bytes:
        return self._inner.read(max_bytes, self._deadline.left_s(timeout))

    def write(self, buffer: bytes, timeout: float | None = None) -> None:
        view = memoryview(buffer)
        while view:  # in pieces, so that each gets only the remaining time
            self._inner.write(bytes(view[:65536]), self._deadline.left_s(timeout))
            view = view[65536:]

    def close(self) -> None:
        self._inner.close()

    def start_tls(
        self, ssl_context: ssl.SSLContext, server_hostname: str | None = None, timeout: float | None = None
    ) -> httpcore2.NetworkStream:
        left_s = self._deadline.left_s(timeout, httpcore2.ConnectTimeout)
        inner = self._inner.start_tls(ssl_context, server_hostname, left_s)
        return _Stream(inner, self._deadline)

    def get_extra_info(self, info: str) -> Any:
        return self._inner.get_extra_info(info)


class _Body(httpx2.SyncByteStream):
    """Body stream that translates errors of httpcore."""

    def __init__(self, inner: Any, deadline: Deadline):
        self._inner, self._deadline = inner, deadline

    def __iter__(self) -> Iterator[bytes]:
        with _as_httpx(self._deadline):
            yield from self._inner

    def close(self) -> None:
        self._inner.close()


def proxy_for(url: httpx2.URL) -> httpx2.URL | None:
    """Return the proxy that the environment names for an https address; None for plain http or without a proxy.

    Raises ConfigError for an unusable proxy, without showing it.
    """
    if url.scheme != "https" or proxy_bypass(url.host):
        return None
    proxies = getproxies()
    named = proxies.get("https") or proxies.get("all")
    if not named:
        return None
    try:
        proxy = httpx2.URL(named if "://" in named else f"http://{named}")
    except (httpx2.InvalidURL, ValueError):
        proxy = httpx2.URL("")
    if proxy.scheme not in ("http", "https") or not proxy.host:
        raise ConfigError(
            "https_proxy (or all_proxy) is not the address of a proxy; give http://HOST:PORT, or unset it"
        )
    return proxy


def _port_of(url: httpx2.URL) -> int:
    return url.port or (443 if url.scheme == "https" else 80)


@contextmanager
def _as_httpx(deadline: Deadline) -> Iterator[None]:
    """Translate errors of httpcore, and parser errors, into the httpx errors of the same name."""
    try:
        yield
    except (httpcore2.ConnectTimeout, httpcore2.ConnectError) as error:
        kind: type[httpx2.TransportError] = getattr(httpx2, type(error).__name__)
        failure = kind(str(error))
    except httpcore2.TimeoutException as error:
        failure = getattr(httpx2, type(error).__name__)(deadline.over)
    except (httpcore2.NetworkError, httpcore2.ProtocolError, httpcore2.ProxyError, httpcore2.UnsupportedProtocol) as e:
        failure = getattr(httpx2, type(e).__name__)(str(e))
    except (ValueError, LookupError, ArithmeticError) as error:  # raised by the HTTP parser for invalid input
        failure = httpx2.RemoteProtocolError(f"its answer is not HTTP ({type(error).__name__})")
    else:
        return
    raise failure


@cache
def _tls() -> ssl.SSLContext:
    """Return the SSL context with trusted certificates; cached, because loading takes 34 ms, more than a local request."""
    return httpx2.create_ssl_context()
