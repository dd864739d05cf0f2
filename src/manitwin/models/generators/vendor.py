"""Base class of generators behind a vendor's HTTP service: address, key, price, model, picture upload, paid submission."""

from __future__ import annotations

import base64
import time
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Self
from urllib.parse import urlsplit

import numpy as np

from manitwin.config import BuildConfig, Resource, ServicesConfig
from manitwin.errors import BadReply, ConfigError
from manitwin.formats.image_file import png_of
from manitwin.models.generators.protocol import IMAGE_OR_TEXT, Asked
from manitwin.models.services.download import LONGEST_ADDRESS
from manitwin.models.services.http import HttpService, origin
from manitwin.models.services.keys import bearer, is_local, key_from_environment, split_url
from manitwin.models.services.refusal import Refusal, refusal_by_status

LARGEST_NUMBER = 1e15  # credits, seconds since 1970 in milliseconds


class VendorGenerator:
    """A generator behind a vendor's HTTP service.

    Class attributes: ``name``; ``url``, the address of the service; ``keys``, the environment variables that may hold the
    key; ``default_model``, used if none is named; ``model_option``, the option of ``generate.options`` that may name a model;
    and ``remedy``, the advice for a refused key. ``listed_usd`` is the price of a job by the vendor's list.
    """

    name: str
    url: ClassVar[str]
    keys: ClassVar[tuple[str, ...]]
    default_model: ClassVar[str]
    model_option: ClassVar[str] = ""
    remedy: ClassVar[str]
    needs: Resource = "generator"
    asked_with: frozenset[Asked] = IMAGE_OR_TEXT

    def __init__(
        self,
        model: str,
        url: str,
        key: str | None,
        config: BuildConfig,
        sleep: Callable[[float], None] = time.sleep,
        *,
        listed_usd: float | None = None,
        refusal: Callable[[int, Any], Refusal | None] = refusal_by_status,
    ):
        self.model: str | None = model
        self.usd_per_job = usd_per_job(self.price_label(model), url, config.services, listed_usd)
        self._options: dict[str, Any] = dict(config.generate.options)
        self._service = self._http_service(url, key, config, sleep, refusal)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.model!r}, {self._service.base_url!r})"

    @classmethod
    def from_spec(cls, argument: str, config: BuildConfig) -> Self:
        """Create the generator from ``MODEL@URL``, both optional; raises ConfigError for a missing key or price."""
        said, given = split_url(argument)
        url = service_url(given, cls.url)
        model = choose_model(cls.name, said, config, cls.model_option, cls.default_model)
        return cls(model, url, key_from_environment(cls.keys, url, cls.name), config)

    def price_label(self, model: str) -> str:
        """Return the name used in the error about a missing price."""
        return self.name

    def authorization(self, key: str | None) -> dict[str, str]:
        """Return the headers that carry the key."""
        return bearer(key)

    def _http_service(
        self,
        url: str,
        key: str | None,
        config: BuildConfig,
        sleep: Callable[[float], None],
        refusal: Callable[[int, Any], Refusal | None],
    ) -> HttpService:
        return HttpService(
            self.name,
            url,
            authorization=self.authorization(key),
            services=config.services,
            key=key,
            remedy=self.remedy,
            refusal=refusal,
            sleep=sleep,
        )


def usd_per_job(name: str, url: str, services: ServicesConfig, listed: float | None = None) -> float:
    """Return the price of a job: that of the settings, 0 for a server on this machine, or the vendor's list price.

    Raises ConfigError if the price is unknown.
    """
    if services.usd_per_job is not None:
        return services.usd_per_job
    if is_local(url):
        return 0.0
    if listed is not None:
        return listed
    raise ConfigError(
        f"generator {name}: the price of a job is unknown; set services.usd_per_job to the price in your plan (0"
        f" for your own server)"
    )


def service_url(url: str | None, vendors: str) -> str:
    """Return the address of a service: the vendor's, or the given one, completed with the vendor's path if it has none."""
    if url is None:
        return vendors
    return url if urlsplit(url).path.strip("/") else url.rstrip("/") + urlsplit(vendors).path


def choose_model(name: str, said: str, config: BuildConfig, option: str, default: str) -> str:
    """Return the model named by a spec or an option of the settings, else the default; raises ConfigError if both disagree."""
    set_to = config.generate.options.get(option)
    if said and set_to is not None and said != set_to:
        raise ConfigError(
            f"generator {name}: it says {said} and generate.options.{option} says {set_to}; leave one out"
        )
    return said or str(set_to or default)


def data_uri(rgba: np.ndarray) -> str:
    """Return a matted photo ``(H, W, 4) uint8`` as a data URI of a PNG (RFC 2397)."""
    return "data:image/png;base64," + base64.b64encode(png_of(rgba)).decode()


def submit_paid(service: HttpService, path: str, body: Mapping[str, Any], needed: tuple[str, ...]) -> dict[str, Any]:
    """Submit a paid job and return the answer; its fields ``needed`` are checked to be usable as names.

    Raises Unanswered for an unusable answer with a success status, because the job may have been accepted and paid for.
    """
    answer = service.post_json(path, body, pays=True)
    for name in needed:
        if not is_name(answer.get(name)):
            raise service.unreadable(name, pays=True)
    return answer


def is_name(value: Any) -> bool:
    """Tell whether a value of an answer can be a job id or an address: a printable string in one line of bounded length."""
    return isinstance(value, str) and 0 < len(value) <= LONGEST_ADDRESS and value.isprintable()


def plausible_number(value: Any) -> float | None:
    """Return a value of an answer if it is a number of plausible size, else None."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not -LARGEST_NUMBER <= value <= LARGEST_NUMBER:
        return None
    return value


def checked_address(value: Any, who: str, what: str) -> str:
    """Return an address from a reply; raises BadReply if it is missing or not an address."""
    if not isinstance(value, str) or not value:
        raise BadReply(f"{who}: its answer contains no {what}; run it again")
    if not is_name(value) or origin(value) is None:
        raise BadReply(f"{who}: the {what} in its answer is not an address; run it again")
    return value
