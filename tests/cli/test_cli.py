import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import manitwin.cli.main as main_module


def manitwin(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "manitwin", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, **environment}, timeout=300)


def one_line(text: str) -> str:
    lines = text.strip().splitlines()
    assert len(lines) == 1, text
    return lines[0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("build", "nothing_here.png", "-o", "OUT"), "nothing_here.png: not found"),
        (
            ("build", "a red mug", "-o", "OUT"),
            "a red mug: not found; give an image, a mesh, a folder, or a .csv or .jsonl",
        ),
        (("build", "a red mug", "-o", "OUT"), "put the description of an object behind --text"),
        (("build", "FILE"), "give the folder or URL to write twins into with -o"),
        (("build", "FILE", "-o", "OUT", "--units", "inch"), "Valid: auto, cm, m, mm, none"),
        (("build", "FILE", "-o", "OUT", "--jobs", "0"), "jobs is 0"),
        (("build", "FILE", "-o", "FILE"), "give a folder"),
        (("build", "FILE", "-o", "OUT", "--config", "none.toml"), "none.toml: not found"),
        (("build", "FILE", "-o", "OUT", "--nonsense"), "--nonsense"),
        (("build", "FILE", "-o", "OUT", "--quick", "--require-agreement"), "--quick skips the second engine"),
        (("build", "FILE", "-o", "OUT", "--gripper", "panda", "--gripper", "panda"), "name each only once"),
        (("show", "OUT"), "not found; give a folder that manitwin build made"),
        (("build", "https://example.org/mug.png", "-o", "OUT"), "a URL; URLs are not downloaded: download the file"),
        (("layout", "OUT", "-o", "OUT"), "not found; give a data set"),
        (("layout", "FILE", "-o", "OUT", "--objects", "few"), "give LOW..HIGH"),
        (("trajectories", "FILE", "-o", "OUT", "-n", "0"), "-n is 0; give 1 or more"),
        (("build", "--text", "a hamer", "-o", "OUT"), "--text: no template makes 'a hamer'; did you mean hammer"),
        (("build", "--text", "a mug, 3 m", "-o", "OUT"), "a mug of 3 m: such are 0.08 to 0.16 m; check the unit"),
        (
            ("build", "--text", "a unicorn", "-o", "OUT"),
            "--generator command, fal, meshy, rodin, tripo can make other objects from a text",
        ),
        (("build", "LIST", "-o", "OUT"), "list.csv:3: no template makes 'a unicorn'"),
        (("build", "LIST", "-o", "OUT", "--generator", "hunyuan3d"), "list.csv:3: the generator 'hunyuan3d'"),
        (
            ("build", "LIST", "-o", "OUT", "--generator", "command:sh {image} {out}"),
            "list.csv:3: the generator 'command",
        ),
        (
            ("build", "PHOTO", "-o", "OUT", "--generator", "command:sh {text} {out}"),
            "cannot make a mesh from a photo (dot.png)",
        ),
        (("paint",), "paint"),
    ],
)
def test_wrong_use_is_one_line_and_exit_status_2(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    message: str,
) -> None:
    file = tmp_path / "cup.stl"
    file.write_bytes(b"x")
    (tmp_path / "list.csv").write_text("file,text\ncup.stl,\n,a unicorn\n")
    (tmp_path / "dot.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    places = {
        "FILE": file, "OUT": tmp_path / "out", "LIST": tmp_path / "list.csv", "PHOTO": tmp_path / "dot.png"
    }  # fmt: skip
    monkeypatch.setattr(sys, "argv", ["manitwin", *(str(places.get(a, a)) for a in arguments)])
    assert main_module._run() == 2
    assert message in one_line(capsys.readouterr().err)
    assert not (tmp_path / "out").exists()


def test_the_process_of_a_wrong_use_says_one_line_and_ends_with_2(tmp_path: Path) -> None:
    done = manitwin("build", "--text", "a hamer", "-o", tmp_path / "out")
    assert (done.returncode, done.stdout) == (2, "")
    assert "--text: no template makes 'a hamer'; did you mean hammer" in one_line(done.stderr)
    assert not (tmp_path / "out").exists()


def test_unknown_setting_names_the_nearest(tmp_path: Path) -> None:
    (tmp_path / "cup.stl").write_bytes(b"x")
    (tmp_path / "run.toml").write_text("[verify]\nforce = 20\n")
    done = manitwin("build", tmp_path / "cup.stl", "-o", tmp_path / "out", "--config", tmp_path / "run.toml")
    assert done.returncode == 2
    assert "did you mean 'force_n'" in one_line(done.stderr)


def test_unknown_gripper_is_a_usage_error_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "cup.stl").write_bytes(b"x")
    (tmp_path / "run.toml").write_text('grippers = ["panda", "pandas"]\n')
    done = manitwin("build", tmp_path / "cup.stl", "-o", tmp_path / "out", "--config", tmp_path / "run.toml")
    assert done.returncode == 2
    assert "did you mean 'panda'" in one_line(done.stderr)


def test_missing_vulkan_device_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "cup.stl").write_bytes(b"x")
    nothing = {"VK_DRIVER_FILES": "/dev/null", "VK_ICD_FILENAMES": "/dev/null", "MANITWIN_RENDER_DEVICE_FOUND": "null"}
    done = manitwin("build", tmp_path / "cup.stl", "-o", tmp_path / "out", **nothing)
    assert done.returncode == 4
    assert "Vulkan" in one_line(done.stderr) and "VK_DRIVER_FILES" in done.stderr


def test_doctor_looks_at_everything_that_a_build_needs() -> None:
    done = manitwin("doctor")
    assert done.returncode == 0, done.stdout + done.stderr
    looked_at = [line.split()[1].rstrip(":") for line in done.stdout.splitlines()]
    assert {"python", "packages", "physics", "renderer", "backends", "disk"} <= set(looked_at)


def test_schema_describes_a_twin() -> None:
    done = manitwin("schema")
    assert done.returncode == 0
    assert '"grasps"' in done.stdout and '"Estimate"' in done.stdout


def test_alone_it_prints_the_help() -> None:
    done = manitwin()
    assert (done.returncode, done.stderr) == (0, "")
    assert "Usage: manitwin [OPTIONS] COMMAND" in done.stdout and "trajectories" in done.stdout


def test_version_is_that_of_the_package() -> None:
    done = manitwin("--version")
    assert (done.returncode, done.stdout) == (0, f"manitwin {version('manitwin')}\n")


def test_error_of_a_subcommand_names_its_own_help() -> None:
    said = one_line(manitwin("build", "--wrong").stderr)
    assert said.startswith("manitwin build: No such option: --wrong") and said.endswith("See manitwin build --help")
    said = one_line(manitwin("paint").stderr)
    assert said.startswith("manitwin: No such command 'paint'") and said.endswith("See manitwin --help")


HEAVY = (
    "numpy", "scipy", "trimesh", "sapien", "mujoco", "pxr", "cv2", "pyarrow", "duckdb", "matplotlib", "fsspec",
    "manitwin.pipeline.recipe",
)  # fmt: skip
WRONG_USE = """
import io, json, sys
from contextlib import redirect_stderr, redirect_stdout
from manitwin.cli.main import app, main
import typer

found = {}
commands = typer.main.get_command(app).commands
lines = [[], ["--help"], ["--wrong"], ["paint"], *([name, option] for name in commands for option in ("--wrong", "--help"))]
for line in lines + json.loads(sys.argv[1]):
    sys.argv = ["manitwin", *line]
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()) as errors:
        try:
            main()
        except SystemExit as end:
            found[" ".join(line)] = [end.code, errors.getvalue(), [m for m in json.loads(HEAVY) if m in sys.modules]]
print(json.dumps(found))
"""
WRONG_VALUES = [
    "build",
    "build nothing_here.png -o out",
    "build . -o out --units inch",
    "build . -o out --jobs 0",
    "build . -o out --jobs many",
    "build . -o out --gripper pandas",
    "audit . --engines gazebo",
    "collect add c.sqlite nothing_here --source shop",
    "collect add c.sqlite .",
    "collect status nothing.sqlite",
    "collect plan nothing.sqlite -o out",
    "plan nothing_here",
    "plan . --items 0",
    "plan . --cores 10000000",
    "plan . --core-hour-usd nan",
    "build . -o out --vlm nobody",
    "build . -o out --config none.toml",
    "build",
    "build -o out --executor cloud",
    "layout . -o out --surface bed",
    "layout . -o out --objects few",
    "layout . -o out --robot nobody",
    "trajectories . -o out --robot nobody",
    "trajectories . -o out --format csv",
    "trajectories . -o out --skill juggle",
    "tasks . -o out --robot nobody",
    "segmentation . -o out --format xml",
    "evaluate shapes .",
    "evaluate annotations .",
    "evaluate grasps . --labels .",
    "evaluate grasps . --clip .",
    "evaluate generation . --labels .",
    "evaluate generation . --ulip nothing_here",
    "evaluate generation nothing_here",
    "locate .",
    "locate nothing_here --cloud .",
    "locate . --cloud . --depth .",
    "locate . --depth nothing_here",
    "locate . --tried 0",
    "vqa . -o out --format xml",
    "vqa . -o out --points polar",
    "render . --cameras behind",
    "render . --codec h266",
    "render . --rate-hz 15",
    "render nothing_here",
    "export . -o out --to obj",
    "import . -o out --from obj",
    "query . --table mugs",
    "query . --format xml",
    "retry . --state open",
    "audit . --format xml",
    "doctor everything",
    "fake nobody",
    "completion tcsh",
    "show nothing_here",
    "review nothing_here",
    "review . --port many",
    "review . --sample 0",
    "review sample nothing_here",
    "review sample . --sample 0",
    "review sample . --form a.csv",
    "review import . nothing_here.csv",
    "review report nothing_here",
    "view nothing_here",
    "view . --port many",
    "view . --port 70000",
    "view . --sample 3",
    "view . --static out --sample 0",
    "view . --trials 3",
    "review apply nothing_here",
    "review tune nothing_here",
    "review cutouts nothing_here",
    "review cutouts . --sheet a.txt",
    "review cutouts . --draw --accept c16c",
    "review cutouts . --redraw c16c",
]


def test_wrong_use_and_help_import_nothing_heavy() -> None:
    """What is wrong is said at once: each of these takes seconds where one of the heavy modules is imported on the way."""
    program = WRONG_USE.replace("HEAVY", repr(json.dumps(HEAVY)))
    command = [sys.executable, "-c", program, json.dumps([line.split() for line in WRONG_VALUES])]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert {line: heavy for line, (_, _, heavy) in found.items() if heavy} == {}
    assert {
        line: code
        for line, (code, *_) in found.items()
        if (code or 0) != (0 if line.endswith("--help") or not line else 2)
    } == {}
    assert len(found) > 60
