"""Where a client may connect, and by which way: addresses behind names, proxies, keys by https only."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx2
import pytest

from hostile_services import SECRET, raw_server
from manitwin.config import BuildConfig, ServicesConfig
from manitwin.errors import BadReply, ConfigError, Unavailable
from manitwin.models.fakes.server import FakeServer, Response
from manitwin.models.registry import create
from manitwin.models.services.addresses import AllowedServers, ForbiddenAddress, UnknownName, addresses_of, is_public
from manitwin.models.services.connections import proxy_for
from manitwin.models.services.http import HttpService, origin
from manitwin.models.services.keys import redacted
from scripted_service import KEY, Client, Script, error_of

INSIDE = [
    "127.0.0.1", "127.0.0.2", "127.255.255.254", "10.1.2.3", "172.16.0.1", "192.168.1.1", "169.254.169.254", "100.64.0.1",
    "0.0.0.0", "224.0.0.1", "239.1.1.1", "240.0.0.1", "255.255.255.255", "198.18.0.1", "192.0.2.1", "203.0.113.5",
    "192.0.0.8", "192.88.99.1",
    "::1", "::", "fe80::1", "fe80::1%eth0", "fc00::1", "fd12::1", "fec0::1", "ff02::1", "ff0e::1", "2001:db8::1",
    "::ffff:127.0.0.1", "::ffff:10.0.0.1", "::127.0.0.1", "64:ff9b::7f00:1", "64:ff9b::a9fe:a9fe", "64:ff9b:1::1",
    "2002:7f00:1::", "2001::1", "100::1",
]  # fmt: skip


@pytest.mark.parametrize("address", INSIDE)
def test_address_that_is_not_of_the_public_internet(address: str) -> None:
    assert not is_public(address)


@pytest.mark.parametrize("address", ["8.8.8.8", "1.1.1.1", "172.32.0.1", "2606:4700::1111", "64:ff9b::808:808"])
def test_public_address(address: str) -> None:
    assert is_public(address)


def test_every_address_of_a_name_has_to_be_public_but_for_the_configured_server() -> None:
    reach = AllowedServers("api.example", 443)
    assert reach.checked("cdn.example", 443, ["8.8.8.8", "2606:4700::1111"]) == ["8.8.8.8", "2606:4700::1111"]
    assert reach.checked("API.example", 443, ["10.0.0.7"]) == ["10.0.0.7"]
    for host, port in (("cdn.example", 443), ("api.example", 8443), ("api.example", 80), ("api.example.", 443)):
        with pytest.raises(ForbiddenAddress, match="neither a public address"):
            reach.checked(host, port, ["8.8.8.8", "10.0.0.7"])
    with pytest.raises(ForbiddenAddress, match="not this machine"):
        AllowedServers("localhost", 80, on_this_machine=True).checked("localhost", 80, ["127.0.0.1", "8.8.8.8"])


Names = Callable[[dict[str, list[list[str]]]], list[str]]


@pytest.fixture
def names(monkeypatch: pytest.MonkeyPatch) -> Names:
    """Answer for the name service: for each name a list of answers in turn; gives the names that were looked up."""
    asked: list[str] = []

    def install(answers: dict[str, list[list[str]]]) -> list[str]:
        def getaddrinfo(host: str, port: int, *args: Any, **kwargs: Any) -> Any:
            if host not in answers:
                return real(host, port, *args, **kwargs)
            asked.append(host)
            turn = answers[host][min(asked.count(host), len(answers[host])) - 1]
            return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (address, port)) for address in turn]

        real = socket.getaddrinfo
        monkeypatch.setattr(socket, "getaddrinfo", getaddrinfo)
        return asked

    return install


@pytest.mark.parametrize("answers", [[["127.0.0.1"]], [["8.8.8.8", "127.0.0.1"]], [["169.254.169.254"], ["8.8.8.8"]]])
def test_link_to_a_name_that_leads_inside_is_not_followed(
    names: Names, answers: list[list[str]], tmp_path: Path
) -> None:
    asked = names({"cdn.evil.example": answers})
    with FakeServer(Script(Response(200, b"secret"))) as internal, FakeServer(Script(Response(200, {}))) as server:
        link = f"http://cdn.evil.example:{internal.url.rpartition(':')[2]}/file"
        error = error_of(lambda: Client(server.url).service.download(link, tmp_path / "m"))
    assert type(error) is BadReply and "neither a public address" in str(error) and asked == ["cdn.evil.example"]
    assert not internal.requests and not list(tmp_path.iterdir())


def test_name_is_looked_up_once_and_what_was_checked_is_connected_to(
    names: Names, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked = names({"cdn.evil.example": [["93.184.216.34"], ["127.0.0.1"]]})
    connected: list[Any] = []

    def create_connection(address: Any, *args: Any, **kwargs: Any) -> Any:
        connected.append(address)
        raise ConnectionRefusedError("refused")

    monkeypatch.setattr(socket, "create_connection", create_connection)
    service = Client("https://api.example", retries=0).service
    error = error_of(lambda: service.download("https://cdn.evil.example/file", tmp_path / "m"))
    assert type(error) is Unavailable
    assert asked == ["cdn.evil.example"] and connected == [("93.184.216.34", 443)]


SELVES = [
    "127.0.0.1", "localhost", "127.1", "2130706433", "0x7f000001", "0177.0.0.1", "0.0.0.0", "0", "[::1]", "[::ffff:127.0.0.1]",
    "localhost.", "127.0.0.2", "LOCALHOST", "[::]",
]  # fmt: skip


@pytest.mark.parametrize("host", SELVES)
def test_link_to_this_machine_by_whatever_name_is_not_followed(host: str, tmp_path: Path) -> None:
    with FakeServer(Script(Response(200, b"secret"))) as internal, FakeServer(Script(Response(200, {}))) as server:
        link = f"http://{host}:{internal.url.rpartition(':')[2]}/file"
        error = error_of(lambda: Client(server.url, retries=0).service.download(link, tmp_path / "m"))
    assert isinstance(error, BadReply | Unavailable) and not internal.requests and not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "link", ["http://u:p@{server}/f", "http://{server}\\@evil.example/f", "http://evil.example#@{server}/f"]
)
def test_link_that_two_readers_read_in_two_ways_is_no_link(link: str, tmp_path: Path, names: Names) -> None:
    asked = names({"evil.example": [["127.0.0.1"]]})
    with FakeServer(Script(Response(200, b"data"))) as server:
        address = link.format(server=server.url.removeprefix("http://"))
        error = error_of(lambda: Client(server.url, retries=0).service.download(address, tmp_path / "m"))
        assert type(error) is BadReply and not server.requests and set(asked) <= {"evil.example"}
        assert "not its own host" in str(error_of(lambda: Client(server.url).service.get_json(address)))


def test_name_that_is_not_known_is_said() -> None:
    with pytest.raises(UnknownName, match=r"no-such-name\.invalid cannot be resolved"):
        addresses_of("no-such-name.invalid", 80, 5)
    with pytest.raises(UnknownName):
        addresses_of("x" * 70 + ".example", 80, 5)


def test_name_service_that_does_not_answer_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    answered = threading.Event()

    def getaddrinfo(*args: Any, **kwargs: Any) -> Any:
        answered.wait(60)
        return []

    monkeypatch.setattr(socket, "getaddrinfo", getaddrinfo)
    with pytest.raises(UnknownName, match="no answer from the name service"):
        addresses_of("slow.example", 80, 0.05)
    answered.set()


FOREIGN = [
    "http://127.0.0.2:1", "http://localhost.evil.example", "http://127.0.0.1.nip.io", "http://2130706433", "http://0x7f000001",
    "http://0x7f.1", "http://017700000001", "http://127.1", "http://0", "http://0.0.0.0", "http://[::ffff:127.0.0.1]", "http://[::]",
    "http://localhost.", "http://10.0.0.5:8000", "http://gpu-box:8000/v1", "http://api.openai.com/v1", "http://ip6-localhost",
]  # fmt: skip
KEYED = {
    "openai:m": ("annotator", "MANITWIN_VLM_KEY", "OPENAI_API_KEY"),
    "anthropic:m": ("annotator", "MANITWIN_VLM_KEY", "OPENAI_API_KEY"),
    "rodin": ("generator", "RODIN_API_KEY"),
    "tripo": ("generator", "TRIPO_API_KEY"),
    "meshy": ("generator", "MESHY_API_KEY"),
    "fal": ("generator", "FAL_KEY"),
}


def priced() -> BuildConfig:
    return BuildConfig(services=ServicesConfig(usd_per_job=0, usd_per_million_tokens=(0, 0)))


@pytest.mark.parametrize("url", FOREIGN)
@pytest.mark.parametrize("spec", sorted(KEYED))
def test_key_by_plain_http_to_another_machine_is_wrong_use(
    spec: str, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    kind, *variables = KEYED[spec]
    for variable in variables:
        monkeypatch.setenv(variable, SECRET)
    with pytest.raises(ConfigError, match="a key is sent over https only") as caught:
        create(kind, f"{spec}@{url}", priced())
    assert SECRET not in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("key", ["a\r\nX-Evil: 1", "two words", "\x7f", "schl\u00fcssel", "\u202esk"])
@pytest.mark.parametrize("spec", sorted(KEYED))
def test_key_with_characters_that_no_key_has_is_wrong_use(spec: str, key: str, monkeypatch: pytest.MonkeyPatch) -> None:
    kind, *variables = KEYED[spec]
    for variable in variables:
        monkeypatch.setenv(variable, key)
    with pytest.raises(ConfigError, match="characters that are invalid in a key") as caught:
        create(kind, f"{spec}@http://localhost:1", priced())
    assert key not in str(caught.value) and str(caught.value).isprintable()


def test_server_of_ones_own_without_a_key_may_be_reached_by_plain_http(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MANITWIN_VLM_KEY", raising=False)
    create("annotator", "openai:m@http://gpu-box:8000/v1", priced())
    with pytest.raises(ConfigError, match="MANITWIN_VLM_KEY"):
        create("annotator", "openai:m@https://gpu-box:8000/v1", priced())
    with pytest.raises(ConfigError, match="a query"):
        create("annotator", f"openai:m@http://gpu-box:8000/v1?key={SECRET}", priced())


def test_service_itself_refuses_a_key_by_plain_http() -> None:
    for url in FOREIGN:
        with pytest.raises(ConfigError, match="https only"):
            HttpService("v", url, authorization={}, services=ServicesConfig(), key=SECRET)


PROXIES = ("http_proxy", "https_proxy", "all_proxy", "no_proxy")


@pytest.fixture
def environment(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    for name in PROXIES:
        monkeypatch.delenv(name, raising=False)
        monkeypatch.delenv(name.upper(), raising=False)
    return monkeypatch


def test_plain_http_goes_through_no_proxy(environment: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with raw_server(lambda write: None) as (proxy, seen), FakeServer(Script(Response(200, {"fine": True}))) as server:
        for name in PROXIES[:3]:
            environment.setenv(name, proxy)
        assert Client(server.url).service.get_json("x") == {"fine": True}
        Client(server.url).service.download(f"{server.url}/file", tmp_path / "m")
    assert not seen and len(server.requests) == 2


@pytest.mark.parametrize("variable", ["https_proxy", "HTTPS_PROXY", "all_proxy"])
def test_https_goes_through_a_proxy_by_connect_which_sees_no_key(
    environment: pytest.MonkeyPatch, variable: str
) -> None:
    refused = b"HTTP/1.1 403 \x1b[31mno " + KEY.encode() + b"\r\nContent-Length: 0\r\n\r\n"
    with raw_server(lambda write: write(refused)) as (proxy, seen):
        environment.setenv(variable, proxy.replace("http://", "http://me:pass-word@"))
        error = error_of(lambda: Client("https://api.vendor.example/v1", retries=0).service.get_json("x"))
    assert type(error) is Unavailable and "pass-word" not in str(error) and str(error).isprintable()
    assert len(seen) == 1 and seen[0].startswith(b"CONNECT api.vendor.example:443 HTTP/1.1\r\n")
    assert KEY.encode() not in seen[0] and b"Proxy-Authorization: Basic" in seen[0]


def test_proxy_is_left_out_where_the_environment_says_so(environment: pytest.MonkeyPatch) -> None:
    environment.setenv("https_proxy", "proxy.corp:3128")
    environment.setenv("no_proxy", "inside.example,.corp")
    assert proxy_for(httpx2.URL("https://api.example/x")) == httpx2.URL("http://proxy.corp:3128")
    for url in ("https://inside.example", "https://vlm.corp/v1", "http://api.example"):
        assert proxy_for(httpx2.URL(url)) is None


@pytest.mark.parametrize("proxy", ["socks5://u:pass-word@h:1", "ftp://h", "http://", "http://u:pass-word@[::1", "://"])
def test_proxy_that_cannot_be_used_is_wrong_use_and_not_shown(environment: pytest.MonkeyPatch, proxy: str) -> None:
    environment.setenv("https_proxy", proxy)
    with pytest.raises(ConfigError, match="https_proxy") as caught:
        Client("https://api.vendor.example/v1").service.get_json("x")
    assert "pass-word" not in str(caught.value)


@pytest.fixture
def nobody_knows_localhost(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine without /etc/hosts."""
    known = socket.getaddrinfo

    def look_up(host: Any, *arguments: Any, **more: Any) -> Any:
        if "localhost" in str(host):
            raise socket.gaierror(-2, "Name or service not known")
        return known(host, *arguments, **more)

    monkeypatch.setattr(socket, "getaddrinfo", look_up)


@pytest.mark.parametrize("host", ["localhost", "LocalHost.", "mesh.localhost"])
def test_localhost_is_this_machine_where_no_name_service_knows_it(host: str, nobody_knows_localhost: None) -> None:
    assert addresses_of(host, 80, 5) == ["127.0.0.1", "::1"]
    with pytest.raises(ForbiddenAddress):
        AllowedServers("api.vendor.example", 443).checked(host, 80, addresses_of(host, 80, 5))
    with pytest.raises(UnknownName):
        addresses_of("localhost.example", 80, 5)


def test_proxy_is_not_asked_for_localhost_where_no_name_service_knows_it(
    environment: pytest.MonkeyPatch, tmp_path: Path, nobody_knows_localhost: None
) -> None:
    with raw_server(lambda write: None) as (proxy, seen):
        environment.setenv("https_proxy", proxy)
        service = Client("https://api.vendor.example/v1", retries=0).service
        assert "neither a public address" in str(
            error_of(lambda: service.download("https://localhost:1/x", tmp_path / "m"))
        )
    assert not seen


def test_link_inside_is_not_fetched_by_a_proxy_either(environment: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with raw_server(lambda write: None) as (proxy, seen):
        environment.setenv("https_proxy", proxy)
        for link in ("https://169.254.169.254/latest", "https://localhost:1/x", "https://10.0.0.1/x"):
            service = Client("https://api.vendor.example/v1", retries=0).service
            assert "neither a public address" in str(error_of(lambda: service.download(link, tmp_path / "m")))  # noqa: B023
    assert not seen


def test_origin_is_what_a_request_takes_it_for() -> None:
    assert origin("HTTPS://Api.Example/v1?x#y") == ("https", "api.example", 443)
    assert origin("http://[::1]:80/x") == ("http", "::1", 80)
    for url in (
        "/x",
        "x",
        "",
        "http://",
        "http://u@h",
        "http://h\\@e",
        "http://h:99999",
        "http://a b",
        "http://h/\n",
        "http://[::1",
    ):
        assert origin(url) is None


def test_what_a_server_says_is_one_short_line_that_a_terminal_may_show() -> None:
    said = redacted(f"a\x1b[31m\u202eb\r\n c \x00 Bearer {SECRET} \ud800" + "x" * 10_000_000, SECRET)
    assert said.startswith(r"a\x1b[31m\u202eb c \x00 Bearer ***") and len(said) == 300 and said.isprintable()
