"""Estimators of the user's: what they are asked, what is taken for an answer, and how they fail."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manitwin.config import ServicesConfig
from manitwin.errors import BadReply, ConfigError, Unavailable
from manitwin.models.fakes.catalog import serving
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.pose_estimator import guesses
from manitwin.models.pose_estimators.from_spec import pose_estimator
from manitwin.models.pose_estimators.protocol import PROTOCOL, PoseRequest, parse_guesses

SERVICES = ServicesConfig(retries=0, timeout_s=60)
QUESTION = PoseRequest({"protocol": PROTOCOL}, {"depth.png": b"numbers"})
POSE = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.5], [0, 0, 0, 1]])


def answer(*poses: np.ndarray, model: str = "foundation") -> dict[str, Any]:
    return {"model": model, "poses": [{"object_to_camera": pose.tolist()} for pose in poses]}


def program(tmp_path: Path, text: str) -> str:
    script = tmp_path / "estimate.py"
    script.write_text(text)
    return f"command:{shlex.quote(sys.executable)} {shlex.quote(str(script))} {{request}} {{out}}"


def test_a_program_gets_the_question_as_a_folder_and_its_answer_is_read(tmp_path: Path) -> None:
    told = tmp_path / "told.json"
    spec = program(
        tmp_path,
        f"""
import json, pathlib, sys
folder = pathlib.Path(sys.argv[1])
said = {{"question": json.loads((folder / "request.json").read_text()), "depth": (folder / "depth.png").read_text()}}
pathlib.Path({str(told)!r}).write_text(json.dumps(said))
pathlib.Path(sys.argv[2]).write_text({json.dumps(answer(POSE))!r})
""",
    )
    found = pose_estimator(spec, SERVICES).guess(QUESTION)
    assert found.model == "foundation" and found.poses == pytest.approx(POSE[None])
    assert json.loads(told.read_text()) == {"question": QUESTION.document, "depth": "numbers"}


@pytest.mark.parametrize(
    ("text", "error", "said"),
    [
        ("import sys; sys.exit('no CUDA device')", Unavailable, "ended with status 1: no CUDA device"),
        ("", BadReply, r"wrote nothing to \{out\}"),
        ("import sys; open(sys.argv[2], 'w').write('poses')", BadReply, "command: {out}"),
        ("import sys; open(sys.argv[2], 'w').write('{}')", BadReply, "answered with no 'model'"),
    ],
)
def test_a_program_that_fails_is_told_in_one_line(tmp_path: Path, text: str, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said) as raised:
        pose_estimator(program(tmp_path, text), SERVICES).guess(QUESTION)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("foundationpose", "is not a pose estimator"),
        ("command:", "it needs {request} and {out}"),
        ("command:run {request}", "it needs {request} and {out}"),
        ("command:run {request} {output}", "did you mean 'out'|unknown placeholder"),
        ("command:run 'open {request} {out}", "cannot be split"),
    ],
)
def test_what_names_no_estimator_is_refused(spec: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        pose_estimator(spec, SERVICES)


def turned_over() -> np.ndarray:
    mirrored = POSE.copy()
    mirrored[0, 0] = -1
    return mirrored


@pytest.mark.parametrize(
    "told",
    [
        None,
        [],
        {"poses": [{"object_to_camera": POSE.tolist()}]},
        answer(),
        answer(*[POSE] * 17),
        answer(POSE, model=" "),
        answer(POSE[:3]),
        answer(2 * POSE),
        answer(turned_over()),
        answer(POSE * [1, 1, 1, -1]),
        answer(np.where(POSE == 0.5, np.nan, POSE)),
        {"model": "m", "poses": [None]},
        {"model": "m", "poses": [{"object_to_camera": "eye"}]},
    ],
)
def test_what_is_no_answer_is_refused(told: Any) -> None:
    with pytest.raises(BadReply, match=PROTOCOL):
        parse_guesses(told, "estimator")


def test_a_rotation_of_32_bits_is_made_exact() -> None:
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    pose = POSE.copy()
    pose[:3, :3] = (turn * np.sign(np.linalg.det(turn))).astype(np.float32)
    (found,) = parse_guesses(answer(pose), "estimator").poses
    assert found[:3, :3] @ found[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.parametrize(
    ("fault", "error"), [("server_error", Unavailable), ("not_json", BadReply), ("wrong_schema", BadReply)]
)
def test_a_server_that_fails_is_told(fault: str, error: type[Exception]) -> None:
    with serving("pose", faults=Faults({fault: 1})) as server, pytest.raises(error):
        pose_estimator(server.spec, SERVICES).guess(QUESTION)


def test_the_rehearsal_refuses_what_does_not_keep_the_protocol() -> None:
    with pytest.raises(ValueError, match="protocol, files or camera"):
        guesses({"protocol": "another", "files": {}, "camera": {}}, {})
