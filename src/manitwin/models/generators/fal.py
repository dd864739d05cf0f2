"""The generator ``fal``: any image-to-3d or text-to-3d endpoint behind fal's queue.

API of the queue: https://fal.ai/docs/api-reference/inference-api and .../documentation/model-apis/request-errors; an account
without balance gets status 403 (github.com/fal-ai/fal, issue 1147). Read 2026-11. Not verified: the answer to a rejected key,
and endpoints other than those of ``ENDPOINTS``; the mesh is the first address of a ``.glb`` file in the result.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal
from urllib.parse import urlsplit

from manitwin.config import BuildConfig
from manitwin.errors import BadReply, ConfigError, Unsupported
from manitwin.models.generators.protocol import Asked, Generated, GenerationRequest, JobState
from manitwin.models.generators.vendor import VendorGenerator, checked_address, data_uri, submit_paid
from manitwin.models.services.http import HttpService, origin
from manitwin.models.services.refusal import NotFound, Refusal, error_message, refusal_by_status

VENDOR = "https://queue.fal.run"
# documented hosts of the queue (.../inference-api/openapi/queue.json, "servers"): a key for one is valid for the other
VENDOR_HOSTS = ("queue.fal.run", "queue.falrun.com")
KEY_VARIABLE = "FAL_KEY"
DEFAULT_ENDPOINT = "fal-ai/trellis"
PENDING_STATES: dict[str, Literal["queued", "running"]] = {"IN_QUEUE": "queued", "IN_PROGRESS": "running"}
MOST_PARTS = 100_000  # maximum number of values of a result that are searched for a mesh


@dataclass(frozen=True)
class Endpoint:
    """Input of an endpoint.

    ``image`` is the field of the picture (None: takes no picture) and ``image_list`` whether it is a list; ``prompt`` tells
    whether it takes a text; ``seeds`` is the exclusive upper bound of seeds (None: takes no seed); ``usd`` is the listed
    price of a job.
    """

    image: str | None
    image_list: bool = False
    prompt: bool = False
    seeds: int | None = None
    usd: float | None = None


# each at https://fal.ai/models/ENDPOINT (/api, /llms.txt), prices as listed there, read 2026-11
ENDPOINTS = {
    "fal-ai/trellis": Endpoint("image_url", seeds=2**31, usd=0.02),
    "fal-ai/hyper3d/rodin": Endpoint("input_image_urls", image_list=True, prompt=True, seeds=65536, usd=0.4),
    "fal-ai/hunyuan3d-v3/text-to-3d": Endpoint(None, prompt=True),
    "fal-ai/hunyuan-3d/v3.1/pro/text-to-3d": Endpoint(None, prompt=True),
    "fal-ai/hunyuan-3d/v3.1/pro/image-to-3d": Endpoint("input_image_url"),
}


class FalGenerator(VendorGenerator):
    """Make meshes with an endpoint of fal; ``generate.options`` are added to its input.

    Addresses that a reply gives for follow-up requests are used only on the chosen host, or on the queue's other documented
    host.
    """

    name = "fal"
    url, keys = VENDOR, (KEY_VARIABLE,)
    default_model = DEFAULT_ENDPOINT
    written_name, made = "generated.glb", "GLB"
    remedy = f"check {KEY_VARIABLE} and your balance at https://fal.ai/dashboard/billing"

    def __init__(
        self, endpoint: str, url: str, key: str | None, config: BuildConfig, sleep: Callable[[float], None] = time.sleep
    ):
        if endpoint.count("/") < 1 or not all(endpoint.split("/")):
            raise ConfigError(f"fal: {endpoint!r} is not an endpoint; give OWNER/APP such as {DEFAULT_ENDPOINT}")
        self.takes = self.endpoint_input(endpoint)
        super().__init__(endpoint, url, key, config, sleep, listed_usd=self.takes.usd if url == VENDOR else None)
        takes: dict[Asked, bool] = {"image": self.takes.image is not None, "text": self.takes.prompt}
        self.asked_with = frozenset(asked for asked, taken in takes.items() if taken)
        hosts = [url]
        if url.startswith("https://") and urlsplit(url).netloc in VENDOR_HOSTS:
            hosts += [f"https://{host}" for host in VENDOR_HOSTS if f"https://{host}" != url]
        # services for follow-up requests about an accepted job
        self._begun = [self._http_service(host, key, config, sleep, _refusal_of) for host in hosts]

    @staticmethod
    def endpoint_input(endpoint: str) -> Endpoint:
        """Return the input description of an endpoint."""
        return ENDPOINTS.get(endpoint) or _guess_input(endpoint)

    @staticmethod
    def first_address(result: Any) -> str | None:
        """Return the address of the generated file, None if the result has none."""
        return first_glb(result)

    def price_label(self, model: str) -> str:
        """Return the name used in the error about a missing price: prices belong to endpoints."""
        return f"fal:{model}"

    def authorization(self, key: str | None) -> dict[str, str]:
        """Return the headers that carry the key."""
        return {"Authorization": f"Key {key}"} if key else {}

    def probe(self) -> str:
        """Ask for the status of a request that does not exist: only a valid key is told so (undocumented; costs nothing)."""
        app = "/".join(str(self.model).split("/")[:2])
        with suppress(NotFound):  # the expected answer
            self._service.get_json(f"/{app}/requests/00000000-0000-0000-0000-000000000000/status")
        return "the queue takes the key"

    def submit(self, request: GenerationRequest) -> str:
        """Put a request into the queue and return its status and result addresses as job id.

        Raises Unsupported if the endpoint does not take the kind of input.
        """
        body = self._input(request) | self._options
        answer = submit_paid(self._service, f"/{self.model}", body, ("status_url", "response_url"))
        # the addresses contain the app without its path, so they are stored instead of built from the request's id
        status, response = (checked_address(answer.get(n), "fal", n) for n in ("status_url", "response_url"))
        self._service_of(status)
        self._service_of(response)
        return f"{status} {response}"

    def poll(self, job_id: str) -> JobState:
        """Return the state of a request; a completed request may have failed."""
        status_url, response_url = _split_job_id(job_id)
        status = self._service_of(status_url).get_json(status_url).get("status")
        if isinstance(status, str) and status in PENDING_STATES:
            return JobState(PENDING_STATES[status])
        if status != "COMPLETED":
            raise BadReply(f"fal: the request has the unknown status {self._service.said(str(status))!r}")
        result = self._result(response_url)
        if result.get("detail") and self.first_address(result) is None:
            return JobState("failed", self._service.said(error_message(result)))
        return JobState("done")

    def fetch(self, job_id: str, folder: Path) -> Generated:
        """Download the generated file into ``folder``."""
        response_url = _split_job_id(job_id)[1]

        def link() -> str:
            return checked_address(self.first_address(self._result(response_url)), "fal", self.made)

        path = folder / self.written_name
        self._service.download(link(), path, fresh_url=link)
        return Generated(path, self.model, {"endpoint": self.model})

    def _input(self, request: GenerationRequest) -> dict[str, Any]:
        """Return the endpoint's input for a request; raises Unsupported if the endpoint does not take its kind."""
        takes, body = self.takes, dict[str, Any]()
        if request.rgba is not None:
            if takes.image is None:
                raise Unsupported(
                    f"fal: {self.model} does not accept pictures; give a text, or choose another endpoint"
                )
            picture = data_uri(request.rgba)
            body[takes.image] = [picture] if takes.image_list else picture
        else:
            if not takes.prompt or not request.text:
                raise Unsupported(
                    f"fal: {self.model} cannot make a mesh from text ({request.text!r});"
                    " give a photo, or choose an endpoint whose name has text-to-3d"
                )
            body["prompt"] = request.text
        if takes.seeds is not None:
            body["seed"] = request.seed % takes.seeds
        return body

    def _result(self, response_url: str) -> dict[str, Any]:
        return self._service_of(response_url).get_json(response_url)

    def _service_of(self, url: str) -> HttpService:
        asked = origin(url)
        for service in self._begun:
            if asked is not None and asked == origin(service.base_url):
                return service
        raise BadReply(
            f"fal: it names {self._service.said(urlsplit(url).netloc)!r} to ask next, which is not its own host; the key goes to"
            " no other"
        )


def first_glb(result: Any) -> str | None:
    """Return the first address of a GLB in a result: by its path, or by the file name or content type beside it."""
    for part in _nested_values(result):
        if isinstance(part, str) and _is_glb_address(part):
            return part
        if isinstance(part, Mapping) and isinstance(part.get("url"), str):
            name, kind = str(part.get("file_name") or ""), part.get("content_type")
            if name.lower().endswith(".glb") or kind == "model/gltf-binary":
                return str(part["url"])
    return None


def _nested_values(result: Any) -> Iterator[Any]:
    """Iterate over the values of a nested result in document order, without recursion; at most ``MOST_PARTS``."""
    waiting = [result]
    for _ in range(MOST_PARTS):
        if not waiting:
            return
        part = waiting.pop()
        yield part
        if isinstance(part, Mapping):
            waiting += reversed(list(part.values()))
        elif isinstance(part, list):
            waiting += reversed(part)


def _is_glb_address(text: str) -> bool:
    try:
        parts = urlsplit(text)
    except ValueError:
        return False
    return bool(parts.scheme and parts.netloc) and parts.path.lower().endswith(".glb")


def _split_job_id(job_id: str) -> tuple[str, str]:
    status, _, response = job_id.partition(" ")
    return checked_address(status, "fal", "status_url"), checked_address(response, "fal", "response_url")


def _refusal_of(status: int, body: Any) -> Refusal | None:
    """Read a refusal; an answer that reports a permanently failed request is not one, so that it can be read as a result."""
    if status in (400, 422) or (status >= 500 and isinstance(body, Mapping) and "error_type" in body):
        return None
    return refusal_by_status(status, body)


def _guess_input(endpoint: str) -> Endpoint:
    """Guess from the name of an unlisted endpoint what it takes: a text, a picture, or either."""
    if "text-to-3d" in endpoint:
        return Endpoint(None, prompt=True)
    return Endpoint("image_url", prompt="image-to-3d" not in endpoint)
