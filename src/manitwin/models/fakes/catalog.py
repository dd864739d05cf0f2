"""Registry of the rehearsal servers: their classes, and the options and keys that their clients need."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from manitwin.errors import UsageError, unknown_name_message
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.message_server import MessageServer
from manitwin.models.fakes.server import FakeServer


@dataclass(frozen=True)
class Rehearsal:
    """A rehearsal server.

    ``option`` is the command-line option of the backend and ``spec`` its value (``{url}`` is replaced by the server's address).
    ``key_variable`` is the environment variable of the client's key (None if no key is used). ``command`` takes the option.
    """

    target: str
    option: str
    spec: str
    key_variable: str | None = None
    command: str = "build PHOTO -o OUT"

    @property
    def factory(self) -> Callable[..., Any]:
        """The class of the server."""
        module, _, attribute = self.target.partition(":")
        return getattr(import_module(module), attribute)


# A vendor's own key variable is only used for the vendor's host; keys of other VLM servers are in MANITWIN_VLM_KEY.
REHEARSALS = {
    "openai": Rehearsal(
        "manitwin.models.fakes.openai_chat:FakeOpenAi", "--vlm", "openai:rehearsal@{url}/v1", "MANITWIN_VLM_KEY"
    ),
    "anthropic": Rehearsal(
        "manitwin.models.fakes.anthropic_messages:FakeAnthropic",
        "--vlm",
        "anthropic:rehearsal@{url}",
        "MANITWIN_VLM_KEY",
    ),
    "rodin": Rehearsal("manitwin.models.fakes.rodin:FakeRodin", "--generator", "rodin@{url}/api/v2", "RODIN_API_KEY"),
    "tripo": Rehearsal(
        "manitwin.models.fakes.tripo:FakeTripo", "--generator", "tripo@{url}/v2/openapi", "TRIPO_API_KEY"
    ),
    "meshy": Rehearsal("manitwin.models.fakes.meshy:FakeMeshy", "--generator", "meshy@{url}", "MESHY_API_KEY"),
    "hunyuan3d": Rehearsal("manitwin.models.fakes.hunyuan3d:FakeHunyuan3d", "--generator", "hunyuan3d@{url}"),
    "fal": Rehearsal("manitwin.models.fakes.fal:FakeFal", "--generator", "fal@{url}", "FAL_KEY"),
    "graspgen": Rehearsal("manitwin.models.fakes.grasp_servers:FakeGraspGen", "--grasper", "graspgen@{url}"),
    "pose": Rehearsal(
        "manitwin.models.fakes.pose_estimator:FakePoseEstimator", "--estimator", "{url}", command="locate TWIN ..."
    ),
    "graspgenx": Rehearsal("manitwin.models.fakes.grasp_servers:FakeGraspGenX", "--grasper", "graspgenx@{url}"),
}


@dataclass(frozen=True)
class Serving:
    """A running server: its address, its key (None if it needs none), and the option to pass to a build."""

    url: str
    key: str | None
    option: str
    spec: str
    key_variable: str | None
    command: str


@contextmanager
def serving(
    name: str, *, port: int = 0, faults: Faults | None = None, key: str | None = None, polls: int | None = None
) -> Iterator[Serving]:
    """Run the server ``name`` on this machine within the context; raises UsageError for invalid arguments.

    ``polls`` is the number of status requests until a job is done.
    """
    if name not in REHEARSALS:
        raise UsageError(unknown_name_message("server", name, REHEARSALS))
    rehearsal = REHEARSALS[name]
    factory = rehearsal.factory
    takes = inspect.signature(factory).parameters
    given: dict[str, Any] = {"faults": faults or Faults()}
    if polls is not None and "polls" not in takes:
        raise UsageError(f"{name} has no jobs to poll: leave --polls out")
    if key is not None and rehearsal.key_variable is None:
        raise UsageError(f"{name} needs no key: leave --key out")
    given |= {word: value for word, value in (("key", key), ("polls", polls)) if value is not None}
    if rehearsal.key_variable is not None and key is None:
        key = takes["key"].default
    with _server(factory, given, port) as server:
        spec = rehearsal.spec.format(url=server.url)
        yield Serving(server.url, key, rehearsal.option, spec, rehearsal.key_variable, rehearsal.command)


def _server(factory: Callable[..., Any], given: dict[str, Any], port: int) -> MessageServer | FakeServer:
    if "port" in inspect.signature(factory).parameters:  # it is a server itself, not a service for an HTTP server
        return factory(**given, port=port)
    try:
        return FakeServer(factory(**given), port)
    except OSError as error:
        raise UsageError(f"port {port} cannot be used: {error}; give another with --port") from error
