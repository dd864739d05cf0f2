"""Programs of the user's own: what they are given, how they end, and that they end."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rehearsed_jobs import photo

from manitwin.config import BuildConfig, GenerateConfig
from manitwin.engine.job_memory import NullJobMemory
from manitwin.errors import BadReply, ConfigError, Rejected, Unavailable, Unsupported
from manitwin.models.fakes.meshes import bottle, glb, truncated
from manitwin.models.generators.command import CommandGenerator
from manitwin.models.generators.protocol import GenerationRequest
from manitwin.models.generators.run import run_generator
from manitwin.models.services.refusal import NotFound

NASTY = """a "blue" bottle; rm -rf $HOME `id` $(id) {out} {seed} 'x' \\ --help & | > /tmp/x
second line"""


@pytest.fixture
def program(tmp_path: Path) -> Path:
    """A program that tells of itself in told.json and copies a bottle to the file after --out."""
    (tmp_path / "bottle.glb").write_bytes(glb([bottle()]))
    script = tmp_path / "make.py"
    script.write_text(
        f"""
import json, os, shutil, sys
told = {{"argv": sys.argv[1:], "environment": dict(os.environ), "folder": os.path.dirname(sys.argv[-1])}}
if "--image" in sys.argv:
    shutil.copy(sys.argv[sys.argv.index("--image") + 1], {str(tmp_path / "seen.png")!r})
open({str(tmp_path / "told.json")!r}, "w").write(json.dumps(told))
shutil.copy({str(tmp_path / "bottle.glb")!r}, sys.argv[-1])
"""
    )
    return script


def command(*words: object, max_wait_s: float = 120, environment: str = "") -> CommandGenerator:
    generate = GenerateConfig(
        max_wait_s=max_wait_s, attempts=1, options={"environment": environment} if environment else {}
    )
    line = shlex.join(str(word) for word in words)
    return CommandGenerator.from_spec(line, BuildConfig(generate=generate))


def script(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "script.py"
    path.write_text(text)
    return path


def told(tmp_path: Path) -> dict[str, object]:
    value = json.loads((tmp_path / "told.json").read_text())
    assert isinstance(value, dict)
    return value


def outcome(generator: CommandGenerator, request: GenerationRequest, folder: Path) -> Path:
    job_id = generator.submit(request)
    assert generator.poll(job_id).state == "done"
    return generator.fetch(job_id, folder).path


def test_program_is_given_the_matted_photo_and_leaves_a_mesh(program: Path, tmp_path: Path) -> None:
    generator = command(sys.executable, program, "--image", "{image}", "--seed={seed}", "{out}")
    made = outcome(generator, photo(), tmp_path)
    assert np.array_equal(np.asarray(Image.open(tmp_path / "seen.png")), photo().rgba)
    assert made.read_bytes() == glb([bottle()]) and "--seed=3" in told(tmp_path)["argv"]  # type: ignore[operator]
    assert str(told(tmp_path)["argv"][-1]).endswith(".glb")  # type: ignore[index]
    assert not Path(str(told(tmp_path)["folder"])).exists()
    assert generator.model == f"{Path(sys.executable).name} make.py" and str(tmp_path) not in str(generator.model)


def test_text_is_one_argument_whatever_it_holds(program: Path, tmp_path: Path) -> None:
    outcome(
        command(sys.executable, program, "{text}", "--t={text}", "{out}"),
        GenerationRequest(None, NASTY, None, 0),
        tmp_path,
    )
    arguments = told(tmp_path)["argv"]
    assert isinstance(arguments, list)
    assert arguments[:2] == [NASTY, f"--t={NASTY}"] and len(arguments) == 3


def test_no_shell_reads_the_command(program: Path, tmp_path: Path) -> None:
    line = f"{sys.executable} {program} ';' '$HOME' '&&' {{text}} {{out}}"
    outcome(CommandGenerator.from_spec(line, BuildConfig()), GenerationRequest(None, "x", None, 0), tmp_path)
    assert told(tmp_path)["argv"][:4] == [";", "$HOME", "&&", "x"]  # type: ignore[index]


def test_keys_of_the_environment_are_not_passed_unless_named(
    program: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("FAL_KEY", "OPENAI_API_KEY", "AWS_SECRET_ACCESS_KEY", "MY_LICENCE", "CUDA_VISIBLE_DEVICES"):
        monkeypatch.setenv(name, f"value of {name}")
    words = (sys.executable, program, "{text}", "{out}")
    outcome(command(*words), GenerationRequest(None, "x", None, 0), tmp_path)
    given = told(tmp_path)["environment"]
    assert isinstance(given, dict)
    assert "CUDA_VISIBLE_DEVICES" in given and given["PATH"] == os.environ["PATH"]
    assert not {"FAL_KEY", "OPENAI_API_KEY", "AWS_SECRET_ACCESS_KEY", "MY_LICENCE"} & set(given)
    outcome(command(*words, environment="MY_LICENCE"), GenerationRequest(None, "x", None, 0), tmp_path)
    named = told(tmp_path)["environment"]
    assert isinstance(named, dict)
    assert named["MY_LICENCE"] == "value of MY_LICENCE" and "FAL_KEY" not in named


def test_secret_that_a_program_prints_is_not_repeated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HF_TOKEN", "hf_s3cret")
    fails = script(tmp_path, "import os, sys; sys.exit('refused ' + os.environ['HF_TOKEN'])")
    generator = command(sys.executable, fails, "{text}", "{out}")
    state = generator.poll(generator.submit(GenerationRequest(None, "x", None, 0)))
    assert "refused ***" in state.message and "s3cret" not in state.message


def test_failure_is_told_by_its_last_line(tmp_path: Path) -> None:
    fails = script(tmp_path, "import sys; print('loading', file=sys.stderr); sys.exit('no object found\\n\\n')")
    generator = command(sys.executable, fails, "{image}", "{out}")
    with pytest.raises(Rejected, match=r"script\.py ended with status 1: no object found"):
        run_generator(generator, photo(), tmp_path, settings=GenerateConfig(attempts=1), jobs=NullJobMemory())


@pytest.mark.parametrize(
    ("text", "words", "max_wait_s"),
    [
        ("raise SystemExit(75)", "asks to be run later", 120),
        ("import os; os.kill(os.getpid(), 9)", "ended by signal 9", 120),
        ("import time; time.sleep(60)", "did not end in 1 s", 1),
    ],
)
def test_what_is_no_fault_of_the_object_leaves_it_waiting(
    tmp_path: Path, text: str, words: str, max_wait_s: float
) -> None:
    generator = command(sys.executable, script(tmp_path, text), "{image}", "{out}", max_wait_s=max_wait_s)
    with pytest.raises(Unavailable, match=words):
        generator.submit(photo())


@pytest.mark.parametrize("program_name", ["no-such-program-anywhere", "/bin"])
def test_program_that_cannot_be_run_is_unavailable(program_name: str) -> None:
    generator = command(program_name, "{image}", "{out}")
    with pytest.raises(Unavailable, match=program_name):
        generator.submit(photo())
    with pytest.raises(Unavailable, match=program_name):
        generator.probe()


def test_script_with_a_missing_interpreter_is_unavailable(tmp_path: Path) -> None:
    broken = script(tmp_path, "#!/no/such/interpreter\n")
    broken.chmod(0o755)
    with pytest.raises(Unavailable, match="could not be started"):
        command(broken, "{image}", "{out}").submit(photo())


@pytest.mark.parametrize(
    ("content", "words"),
    [(None, "wrote nothing"), (b"", "not a mesh"), (b"hello", "not a mesh"), (b"v 0 0 0\n", "wrote obj")],
)
def test_output_has_to_be_a_mesh(tmp_path: Path, content: bytes | None, words: str) -> None:
    text = "" if content is None else f"import sys; open(sys.argv[-1], 'wb').write({content!r})"
    generator = command(sys.executable, script(tmp_path, text), "{image}", "{out}")
    job_id = generator.submit(photo())
    with pytest.raises(BadReply, match=words):
        generator.fetch(job_id, tmp_path)
    with pytest.raises(NotFound):
        generator.poll(job_id)


def test_truncated_mesh_is_rejected(tmp_path: Path) -> None:
    (tmp_path / "half.glb").write_bytes(truncated(glb([bottle()])))
    text = f"import shutil, sys; shutil.copy({str(tmp_path / 'half.glb')!r}, sys.argv[-1])"
    generator = command(sys.executable, script(tmp_path, text), "{image}", "{out}")
    with pytest.raises(Rejected):
        run_generator(generator, photo(), tmp_path, settings=GenerateConfig(attempts=1), jobs=NullJobMemory())


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("", "nothing to run"),
        ("make {image}", "{out}"),
        ("make {out}", "{image} or {text}"),
        ("make {imge} {out}", "did you mean 'image'"),
        ("make 'unclosed {image} {out}", "cannot be split"),
    ],
)
def test_command_that_cannot_be_is_a_mistake_in_the_settings(line: str, words: str) -> None:
    with pytest.raises(ConfigError) as caught:
        CommandGenerator.from_spec(line, BuildConfig())
    assert words in str(caught.value)


def test_unknown_option_is_a_mistake_in_the_settings() -> None:
    config = BuildConfig(generate=GenerateConfig(options={"steps": 4}))
    with pytest.raises(ConfigError, match="environment"):
        CommandGenerator.from_spec("make {image} {out}", config)


def test_what_a_command_does_not_take_is_not_asked_of_it() -> None:
    with pytest.raises(Unsupported, match="cannot make a mesh from text"):
        command(sys.executable, "{image}", "{out}").submit(GenerationRequest(None, "a cup", None, 0))
    with pytest.raises(Unsupported, match=r"no \{image\}"):
        command(sys.executable, "{text}", "{out}").submit(photo())


BEATS = """
import os, subprocess, sys, time
if "child" not in sys.argv:
    subprocess.Popen([sys.executable, *sys.argv, "child"])
while True:
    open(sys.argv[1] + str(os.getpid()), "w").write(str(time.monotonic()))
    time.sleep(0.05)
"""


def heartbeats(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in folder.glob("beat*")}


def check_ended(folder: Path) -> None:
    """Assert that two processes have written, and wait until neither runs any more."""
    pids = [int(name.removeprefix("beat")) for name in heartbeats(folder)]
    assert len(pids) == 2
    while any(map(is_running, pids)):
        time.sleep(0.02)


def is_running(pid: int) -> bool:
    """Tell whether a process is there and no zombie; proc(5): the state stands after the name in brackets."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_time_limit_ends_the_program_and_what_it_started(tmp_path: Path) -> None:
    beats = script(tmp_path, BEATS)
    generator = command(sys.executable, beats, tmp_path / "beat", "{image}", "{out}", max_wait_s=6)
    with pytest.raises(Unavailable, match="did not end"):
        generator.submit(photo())
    check_ended(tmp_path)


@pytest.mark.parametrize("signal_", [signal.SIGINT, signal.SIGKILL])
def test_program_ends_with_whoever_asked_for_it(tmp_path: Path, signal_: int) -> None:
    beats = script(tmp_path, BEATS)
    line = shlex.join([sys.executable, str(beats), str(tmp_path / "beat"), "{text}", "{out}"])
    asking = tmp_path / "asking.py"
    asking.write_text(
        "from manitwin.config import BuildConfig\n"
        "from manitwin.models.generators.command import CommandGenerator\n"
        "from manitwin.models.generators.protocol import GenerationRequest\n"
        f"CommandGenerator.from_spec({line!r}, BuildConfig()).submit(GenerationRequest(None, 'x', None, 0))\n"
    )
    environment = {**os.environ, "TMPDIR": str(tmp_path)}  # what a killed process leaves behind
    process = subprocess.Popen([sys.executable, str(asking)], stderr=subprocess.DEVNULL, env=environment)
    try:
        until = time.monotonic() + 60
        while len(heartbeats(tmp_path)) < 2 and time.monotonic() < until:
            time.sleep(0.05)
        process.send_signal(signal_)
        process.wait(60)
    finally:
        process.kill()
    check_ended(tmp_path)
