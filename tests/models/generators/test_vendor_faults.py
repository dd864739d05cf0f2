"""Rodin and Tripo under every fault of their services, with what was asked and paid for counted at the service."""

from __future__ import annotations

import traceback
from pathlib import Path
from typing import Any

import pytest

from generator_runs import KEY, USD, Fuse, FusedGenerator, Ran, config, run, text_request
from manitwin.errors import AccessDenied, BadReply, RateLimited, Rejected, Unavailable
from manitwin.models.fakes.faults import ALWAYS, Faults
from manitwin.models.services.refusal import AnswerLost
from served_vendors import VENDORS, Vendor, serving, set_keys


@pytest.fixture(autouse=True)
def _key(monkeypatch: pytest.MonkeyPatch) -> None:
    set_keys(monkeypatch)


@pytest.fixture(params=sorted(VENDORS))
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def _no_key_in(folder: Path, ran: Ran, vendor: Vendor, generator: Any) -> None:
    texts = [repr(generator), str(ran.made)]
    if ran.error is not None:
        texts += ["".join(traceback.format_exception(ran.error)), repr(ran.error), repr(ran.error.args)]
    assert not any(KEY in text for text in texts)
    for path in folder.rglob("*"):
        assert KEY not in path.name and (path.is_dir() or KEY.encode() not in path.read_bytes())
    for request in vendor.server.requests:
        if request.path.startswith("/files/"):
            assert "authorization" not in request.headers and KEY not in str(request)


OVERCOME = [  # fault, times, tasks taken, waits that it cost
    ("rate_limited", 1, 1, 1),
    ("job_fails", 1, 2, None),
    ("truncated_mesh", 1, 2, None),
    ("draco_mesh", 1, 2, None),
    ("open_mesh", 1, 2, None),
    ("empty_mesh", 1, 1, 1),
    ("expired_link", 1, 1, 0),
    ("webp_texture", ALWAYS, 1, 0),
    ("z_up_mesh", ALWAYS, 1, 0),
    ("two_meshes", ALWAYS, 1, 0),
]


@pytest.mark.parametrize(("fault", "times", "tasks", "more_waits"), OVERCOME)
def test_faults_that_are_overcome(
    name: str, tmp_path: Path, fault: str, times: int, tasks: int, more_waits: int | None
) -> None:
    with serving(name, **{fault: times}) as vendor:
        settings = config()
        generator = vendor.generator(settings)
        ran = run(generator, tmp_path, settings)
        assert ran.error is None and ran.made is not None and ran.made.path.stat().st_size > 10_000
        assert len(vendor.fake.tasks) == tasks and ran.usd == USD * tasks
        assert vendor.seeds == list(range(7, 7 + tasks))
        if more_waits is not None:
            assert len(ran.waits) == 2 and len(vendor.waits) == more_waits
        _no_key_in(tmp_path, ran, vendor, generator)


FINAL = [  # fault, error, words, tasks taken, submits, whether the job stays remembered
    ("unauthorized", AccessDenied, "_API_KEY", 0, None, False),
    ("out_of_credit", AccessDenied, "credit", 0, 1, False),
    ("rate_limited", RateLimited, "run again later", 0, None, False),
    ("server_error", Unavailable, "HTTP 500", 0, None, False),
    ("job_fails", Rejected, "2 times in 2", 2, 2, False),
    ("job_never_ends", Unavailable, "still running", 1, 1, True),
    ("truncated_mesh", Rejected, "truncated", 2, 2, False),
    ("empty_mesh", BadReply, "is empty", 1, 1, True),
    ("expired_link", BadReply, "no longer valid", 1, 1, True),
    ("draco_mesh", Rejected, "KHR_draco_mesh_compression", 2, 2, False),
    ("open_mesh", Rejected, "watertight", 2, 2, False),
]


@pytest.mark.parametrize(("fault", "kind", "words", "tasks", "submits", "remembered"), FINAL)
def test_faults_that_last(
    name: str, tmp_path: Path, fault: str, kind: type, words: str, tasks: int, submits: int | None, remembered: bool
) -> None:
    with serving(name, **{fault: ALWAYS}) as vendor:
        settings = config()
        generator = vendor.generator(settings)
        ran = run(generator, tmp_path, settings)
        assert type(ran.error) is kind and words in str(ran.error) and str(ran.error).count("\n") == 0
        assert len(vendor.fake.tasks) == tasks and ran.usd == USD * tasks
        assert submits is None or vendor.submits == submits
        if isinstance(ran.error, Rejected):
            assert ran.error.reason == "generator_failed"
        if isinstance(ran.error, RateLimited):
            assert ran.error.retry_after_s == 1
        assert len(list((tmp_path / "jobs").glob("*"))) == remembered
        assert not [path for path in tmp_path.iterdir() if path.is_file()]
        _no_key_in(tmp_path, ran, vendor, generator)
        # once it is over, the same request ends well, and what was remembered is not paid for again
        vendor.fake.faults = Faults()
        again = run(vendor.generator(settings), tmp_path, settings)
        assert again.made is not None and again.usd == (0 if remembered else USD)
        assert len(vendor.fake.tasks) == tasks + (not remembered)


LOST = ["hangs", "disconnects", "not_json", "wrong_schema"]


@pytest.mark.parametrize("fault", LOST)
def test_submit_whose_answer_is_lost_is_not_repeated(name: str, tmp_path: Path, fault: str) -> None:
    with serving(name) as vendor:
        settings = config(timeout_s=2 if fault == "hangs" else 30)
        # a text needs no upload: the first request is the submit
        vendor.fake.faults = Faults({fault: 1})
        ran = run(vendor.generator(settings), tmp_path, settings, request=text_request())
        assert type(ran.error) is AnswerLost and isinstance(ran.error, Unavailable) and ran.usd == USD
        assert len(vendor.fake.tasks) == vendor.submits == 1
        again = run(vendor.generator(settings), tmp_path, settings, request=text_request())
        assert type(again.error) is BadReply and "services.submit_again" in str(again.error) and again.usd == 0
        assert vendor.submits == 1
        allowed = run(vendor.generator(settings), tmp_path, settings, request=text_request(), submit_again=True)
        assert allowed.made is not None and allowed.usd == USD and vendor.submits == 2


@pytest.mark.parametrize("fault", ["hangs", "disconnects", "server_error"])
def test_polls_and_downloads_are_repeated(name: str, tmp_path: Path, fault: str) -> None:
    with serving(name) as vendor:
        settings = config(timeout_s=2 if fault == "hangs" else 30)
        inner = vendor.generator(settings)
        asked: list[str] = []

        def strike(work: str) -> None:
            asked.append(work)
            if asked.count(work) == 1:
                vendor.fake.faults = Faults({fault: 1})

        class Struck(FusedGenerator):
            def poll(self, job_id: str) -> Any:
                strike("poll")
                return self.inner.poll(job_id)

            def fetch(self, job_id: str, folder: Path) -> Any:
                strike("fetch")
                return self.inner.fetch(job_id, folder)

        ran = run(Struck(inner, Fuse(-1)), tmp_path, settings)
        assert ran.made is not None and len(vendor.fake.tasks) == 1 and ran.usd == USD


def test_download_that_is_cut_is_repeated(name: str, tmp_path: Path) -> None:
    with serving(name) as vendor:
        settings = config()
        generator = vendor.generator(settings)
        served = vendor.fake._file
        cuts: list[int] = []

        def cut_once(request: Any) -> Any:
            if not cuts:
                cuts.append(1)
                vendor.fake.faults = Faults({"disconnects": 1})
            return served(request)

        vendor.fake._file = cut_once
        ran = run(generator, tmp_path, settings)
        assert ran.made is not None and len(vendor.fake.tasks) == 1
        assert sum(request.path.startswith("/files/") for request in vendor.server.requests) == 2


def test_text_needs_no_picture(name: str, tmp_path: Path) -> None:
    with serving(name) as vendor:
        settings = config()
        ran = run(vendor.generator(settings), tmp_path, settings, request=text_request())
        assert ran.made is not None and ran.made.path.suffix == ".glb" and not ran.made.metric
        assert vendor.submits == 1 and not any("upload" in request.path for request in vendor.server.requests)


def test_probe_costs_nothing(name: str) -> None:
    with serving(name) as vendor:
        assert vendor.generator(config()).probe() in ("12 credits left", "600 credits left")
        assert not vendor.fake.tasks and len(vendor.server.requests) == 1
    with serving(name, unauthorized=1) as vendor, pytest.raises(AccessDenied, match=f"{name.upper()}_API_KEY"):
        vendor.generator(config()).probe()


def test_wrong_key_is_refused_and_not_shown(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv(f"{name.upper()}_API_KEY", "another-key-entirely")
    with serving(name) as vendor:
        settings = config()
        ran = run(vendor.generator(settings), tmp_path, settings)
        assert (
            type(ran.error) is AccessDenied and "another-key" not in str(ran.error) and len(vendor.server.requests) == 1
        )


def test_service_that_is_not_there(name: str, tmp_path: Path) -> None:
    with serving(name) as vendor:
        pass
    settings = config(retries=1)
    ran = run(vendor.generator(settings), tmp_path, settings)
    assert type(ran.error) is Unavailable and vendor.waits == [1] and ran.usd == 0
    assert not list(tmp_path.rglob("*.json"))


def test_free_service_on_this_machine_needs_neither_key_nor_price(
    name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv(f"{name.upper()}_API_KEY")
    monkeypatch.delenv("HYPER3D_API_KEY", raising=False)
    with serving(name) as vendor:
        settings = config(usd=None)
        generator = vendor.generator(settings)
        assert generator.usd_per_job == 0
        ran = run(generator, tmp_path, settings)
        assert type(ran.error) is AccessDenied  # this one asks for a key all the same
        assert "authorization" not in vendor.server.requests[0].headers
