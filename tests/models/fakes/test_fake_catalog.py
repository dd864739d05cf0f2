"""Every rehearsal server by its name: it starts, and what is said to a client is what a client takes."""

from __future__ import annotations

import pytest

from manitwin.config import BuildConfig, ServicesConfig
from manitwin.errors import UsageError
from manitwin.models.fakes.catalog import REHEARSALS, serving
from manitwin.models.fakes.faults import Faults
from manitwin.models.registry import create

KINDS = {"--vlm": "annotator", "--generator": "generator", "--grasper": "grasper"}


@pytest.mark.parametrize("name", REHEARSALS)
def test_its_client_finds_a_working_service(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with serving(name) as server:
        if server.key_variable is not None:
            monkeypatch.setenv(server.key_variable, str(server.key))
        backend = create(KINDS[server.option], server.spec, BuildConfig(services=ServicesConfig(cache=False)))
        assert backend.probe()


@pytest.mark.parametrize("name", REHEARSALS)
def test_faults_can_be_asked_for(name: str) -> None:
    with serving(name, faults=Faults({"server_error": 1})) as server:
        assert "127.0.0.1" in server.url
        assert server.url in server.spec


def test_unknown_names_list_the_valid_ones() -> None:
    with pytest.raises(UsageError, match=r"unknown server 'rodan'; did you mean 'rodin'.*graspgen"), serving("rodan"):
        pass


@pytest.mark.parametrize("given", [{"polls": 3}, {"key": "secret"}])
def test_what_a_server_does_not_have_cannot_be_chosen(given: dict[str, int | str]) -> None:
    with pytest.raises(UsageError, match="leave --"), serving("graspgen", **given):  # type: ignore[arg-type]
        pass


def test_a_key_can_be_chosen() -> None:
    with serving("meshy", key="msy_mine", polls=0) as server:
        assert server.key == "msy_mine"


@pytest.mark.parametrize("name", ["meshy", "graspgen"])
def test_a_port_that_is_taken_is_a_usage_error(name: str) -> None:
    with serving(name) as server:
        port = int(server.url.rpartition(":")[2])
        with pytest.raises(UsageError, match="give another with --port"), serving(name, port=port):
            pass
