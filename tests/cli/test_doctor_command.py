"""``manitwin doctor`` about a backend: one line that says what works, what it cost and how long it took."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import typer

from manitwin.cli.commands.doctor import doctor
from manitwin.config import BuildConfig
from manitwin.engine.charges import charge
from manitwin.errors import AccessDenied, ConfigError, UsageError
from manitwin.models import registry
from manitwin.models.fakes.grasp_servers import FakeGraspGen


class Charging:
    """A generator whose request costs, and may be refused."""

    def __init__(self, argument: str):
        self.argument = argument

    @classmethod
    def from_spec(cls, argument: str, config: BuildConfig) -> Charging:
        assert not config.services.cache and config.services.record is None
        if argument == "free":
            raise ConfigError("made: set services.usd_per_job")
        return cls(argument)

    def probe(self) -> str:
        charge(0.0123)
        if self.argument == "poor":
            raise AccessDenied("made: no credit is left;\n top it up")
        return "12 credits left"


@pytest.fixture(autouse=True)
def backends(monkeypatch: pytest.MonkeyPatch) -> None:
    known = {
        "annotator": {"rules": "manitwin.models.annotators.rules:RulesAnnotator"},
        "generator": {"lift": "manitwin.models.generators.lift:LiftGenerator", "made": f"{__name__}:Charging"},
        "grasper": {
            "antipodal": "manitwin.models.graspers.surface_sampling:AntipodalGrasper",
            "graspgen": "manitwin.models.graspers.graspgen:GraspGenGrasper",
        },
    }
    monkeypatch.setattr(registry, "backends", lambda: known)


def said(capsys: pytest.CaptureFixture[str], what: str | None = None, **options: Any) -> tuple[str, int]:
    """Return the one line and the exit status."""
    with pytest.raises(typer.Exit) as ended:
        doctor(what, **{"vlm": None, "generator": None, "grasper": None, "config": None, **options})
    [line] = capsys.readouterr().out.splitlines()
    return line, ended.value.exit_code


def test_a_served_model_that_answers(capsys: pytest.CaptureFixture[str]) -> None:
    with FakeGraspGen() as fake:
        line, status = said(capsys, "grasper", grasper=f"graspgen:@{fake.url}")
    works = re.escape(
        f"ok      graspgen:@{fake.url}: serves franka_panda (diffusion-discriminator); it is a rehearsal server, not a model"
    )
    assert re.fullmatch(works + r" \(0\.0000 USD, \d+\.\d s\)", line)
    assert status == 0


def test_a_served_model_that_does_not_answer(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    settings = tmp_path / "run.toml"
    settings.write_text('grasper = "graspgen:@tcp://127.0.0.1:9"\n[services]\nretries = 0\ntimeout_s = 0.2\n')
    line, status = said(capsys, "grasper", config=settings)
    assert line.startswith("failed  graspgen:@tcp://127.0.0.1:9: graspgen: nothing listens at tcp://127.0.0.1:9")
    assert status == 4


def test_what_it_cost_is_said_also_where_it_failed(capsys: pytest.CaptureFixture[str]) -> None:
    line, status = said(capsys, "generator", generator="made:rich")
    assert re.fullmatch(r"ok      made:rich: 12 credits left \(0\.0123 USD, 0\.\d s\)", line)
    assert status == 0
    line, status = said(capsys, "generator", generator="made:poor")
    assert re.fullmatch(r"failed  made:poor: made: no credit is left; top it up \(0\.0123 USD, 0\.\d s\)", line)
    assert status == 4


def test_a_backend_that_cannot_be_set_up_is_wrong_use_that_says_what_is_missing(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(UsageError, match=r"set services\.usd_per_job"):
        said(capsys, "generator", generator="made:free")


@pytest.mark.parametrize(("what", "name"), [("vlm", "rules"), ("generator", "lift"), ("grasper", "antipodal")])
def test_built_in_backends_have_nothing_to_ask(capsys: pytest.CaptureFixture[str], what: str, name: str) -> None:
    assert said(capsys, what) == (f"ok      {name}: built in, no service to test", 0)


@pytest.mark.parametrize(
    ("what", "options", "message"),
    [
        ("grasper", {"grasper": "graspgun@tcp://h:1"}, "unknown grasper"),
        (None, {"vlm": "openai:x"}, "takes no options"),
        ("vlm", {"config": Path("none.toml")}, "not found"),
    ],
)
def test_wrong_use_is_said(what: str | None, options: dict[str, Any], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        doctor(what, **{"vlm": None, "generator": None, "grasper": None, "config": None, **options})
