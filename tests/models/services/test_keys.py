"""The address of a server in a spec: checked as it is read."""

from __future__ import annotations

import pytest

from manitwin.config import BuildConfig
from manitwin.errors import ConfigError
from manitwin.models.registry import create, without_url
from manitwin.models.services.keys import split_url

MALFORMED = [
    "http://127.0.0.1:40993,",
    "http://h:99999",
    "http://h:x",
    "http://h:0",
    "http://[::1",
    "http://a,b/v1",
    "http://",
    "http://a b/",
]


@pytest.mark.parametrize("url", MALFORMED)
@pytest.mark.parametrize(
    ("kind", "name"),
    [("annotator", "openai:fake"), ("generator", "hunyuan3d"), ("generator", "rodin"), ("generator", "meshy")],
)
def test_malformed_address_is_refused_with_an_example(kind: str, name: str, url: str) -> None:
    with pytest.raises(ConfigError, match=r"is not the URL of a server.*; give one such as http://localhost:8000/v1"):
        create(kind, f"{name}@{url}", BuildConfig())


@pytest.mark.parametrize("url", ["tcp://127.0.0.1:40993,", "tcp://h:x"])
@pytest.mark.parametrize("name", ["graspgen", "graspgenx"])
def test_malformed_address_of_a_grasp_server_is_refused(name: str, url: str) -> None:
    with pytest.raises(ConfigError, match=r"is not the URL of a server.*tcp://localhost:5556"):
        create("grasper", f"{name}@{url}", BuildConfig())


def test_unknown_scheme_lists_those_that_are_known() -> None:
    with pytest.raises(ConfigError, match=r"unknown scheme 'htp'; did you mean 'http'.*Valid: http, https, tcp"):
        split_url("model@htp://localhost")


@pytest.mark.parametrize("url", ["http://me:secret@h:x", "http://me:secret@[::1", "http://secret@h"])
def test_user_and_password_are_refused_and_not_shown(url: str) -> None:
    with pytest.raises(ConfigError, match="user name or password") as refused:
        split_url(f"model@{url}")
    assert "secret" not in str(refused.value)


def test_addresses_of_all_kinds_are_taken() -> None:
    for url in (
        "http://localhost:8000/v1",
        "https://[::1]:8000",
        "http://my_host",
        "tcp://10.0.0.1:5556",
        "HTTPS://vlm.example.com",
    ):
        assert split_url(f"model@{url}") == ("model", url)
        assert without_url(f"openai:model@{url}") == "openai:model"
