"""Every rehearsal server by its name: it starts, and what is said to a client is what a client takes."""

from __future__ import annotations

import pytest

from manitwin.config import BuildConfig, ServicesConfig
from manitwin.errors import AccessDenied, UsageError
from manitwin.models.fakes.catalog import REHEARSALS, serving
from manitwin.models.registry import create

KINDS = {"--vlm": "annotator", "--generator": "generator", "--grasper": "grasper"}


@pytest.mark.parametrize("name", [name for name, each in REHEARSALS.items() if each.option in KINDS])
def test_its_client_finds_a_working_service(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with serving(name) as server:
        if server.key_variable is not None:
            monkeypatch.setenv(server.key_variable, str(server.key))
        backend = create(KINDS[server.option], server.spec, BuildConfig(services=ServicesConfig(cache=False)))
        assert backend.probe()


def test_unknown_names_list_the_valid_ones() -> None:
    with pytest.raises(UsageError, match=r"unknown server 'rodan'; did you mean 'rodin'.*graspgen"), serving("rodan"):
        pass


@pytest.mark.parametrize("given", [{"polls": 3}, {"key": "secret"}])
def test_what_a_server_does_not_have_cannot_be_chosen(given: dict[str, int | str]) -> None:
    with pytest.raises(UsageError, match="leave --"), serving("graspgen", **given):  # type: ignore[arg-type]
        pass


def test_a_chosen_key_is_the_one_that_opens(monkeypatch: pytest.MonkeyPatch) -> None:
    config = BuildConfig(services=ServicesConfig(cache=False))
    with serving("meshy", key="msy_mine", polls=0) as server:
        monkeypatch.setenv("MESHY_API_KEY", "msy_mine")
        assert create("generator", server.spec, config).probe()
        monkeypatch.setenv("MESHY_API_KEY", "msy_other")
        with pytest.raises(AccessDenied):
            create("generator", server.spec, config).probe()


@pytest.mark.parametrize("name", ["meshy", "graspgen"])
def test_a_port_that_is_taken_is_a_usage_error(name: str) -> None:
    with serving(name) as server:
        port = int(server.url.rpartition(":")[2])
        with pytest.raises(UsageError, match="give another with --port"), serving(name, port=port):
            pass
