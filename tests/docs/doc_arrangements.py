"""What stands in for the documents' placeholders, what is made smaller, and what cannot run here and why: all of it.

A command that a page shows and that is not named here runs as it is written. ``test_pages_run.py`` fails for an entry that
no page uses. Of a page that is not named all is done by the slow test, if any of it is slow.
"""

from __future__ import annotations

from dataclasses import dataclass, field

FOREIGN = "a program of others that is not here; a fake stands for it"
NO_NETWORK = "fetches from the network"
CONTAINER = "wants a container engine, and fetches from the network; what is in the container is set up by make setup"


NOTHING_DOUBTED = {r"manitwin review cutouts": 2}
"""The pages' data set has no ledger, and no photo that is rejected for its cut-out; tests/pipeline/test_cutout.py has both."""


@dataclass(frozen=True)
class Arrangement:
    """How a page is run. Patterns are regular expressions, searched in what the page says.

    ``rewritten`` are substitutions in order; ``not_run`` gives the reason of every step that is not run; ``slow`` are
    steps, besides those of ``SLOW``, that only the slow test runs; ``exits`` are statuses that are not 0; ``blocks`` says what
    reads each block that is no program (``doc_blocks``; TOML by itself is settings).
    """

    rewritten: dict[str, str] = field(default_factory=dict)
    not_run: dict[str, str] = field(default_factory=dict)
    slow: tuple[str, ...] = ()
    exits: dict[str, int] = field(default_factory=dict)
    blocks: dict[str, str] = field(default_factory=dict)


SLOW = (
    r"\bmanitwin (build|layout|tasks|trajectories|render|stats|publish|prompts)\b",
    r"\bmanitwin\.(build|make_layouts|make_episodes|write_statistics)\(",
    r"\b(twins|SCENES|EPISODES|TASKS|DONE)\b",
)
"""Steps that take many seconds, or want a folder that does."""

DOCTOR = r"\bmanitwin doctor\b"
"""Starts an engine and a renderer; tests/cli asks it on every run of the tests, and so does docs/backends.md."""

EVERYWHERE: dict[str, str] = {
    # smaller, and in one process
    r"(manitwin build\b)(?!.*--config)": r"\1 --config small.toml",
    r"(manitwin (?:build|layout|tasks|trajectories|render)\b)(?!.*--jobs)(?!.*--executor ray)": r"\1 --jobs 1",
    r"(manitwin (?:layout|trajectories)\b.*) -n \d+": r"\1 -n 2",
    r"(?<!>)> my\.toml": "> my.toml; cat small.toml >> my.toml",
    # a port may be taken
    r"--port \d+": "--port 0",
    # words in capitals stand for something of the reader's
    r"\bTWIN\b": "$TWIN",
    r"\bPHOTO\b": "mug.jpg",
    r"\bMANIFEST\b": "list.csv",
    r"\bINPUT\.\.\.": "mug.jpg scans",
    r"\bPATH\.\.\.": "ASSETS",
    r"(?<==)(tsk_|msy_)?\.\.\.(?= |$)": "rehearsal-key",
    # served grasps, which a name in front of the address tells apart
    r"graspgen@tcp://\S+": "graspgen@$GRASPGEN",
    r"graspgenx@tcp://\S+": "graspgenx@$GRASPGENX",
}

MODEL_SERVERS = {
    r"^vllm serve": FOREIGN,
    r"ollama (pull|serve)": FOREIGN,
}
HUNYUAN = {r"^python api_server\.py": FOREIGN}
GRASP_SERVERS = {
    r"^git clone https://github\.com/NVlabs/GraspGen ": FOREIGN,
    r"python client-server/graspgen_server\.py": FOREIGN,
    r"^git clone https://github\.com/NVlabs/GraspGenX ": FOREIGN,
    r"python client-server/graspgenx_server\.py": FOREIGN,
}
WHEEL = dict.fromkeys(
    (r"^python3 -m venv \.\./manitwin-venv", r"^\.\./manitwin-venv/bin/(pip|manitwin) "),
    "fetches from the network; tests/test_wheel.py does it with what is here",
)
TRIPOSR = {r'"command:python docs/examples/triposr\.py .*"': '"command:python generator.py {image} {out} {seed}"'}
"""The program of the page wants weights; ``generator.py`` makes a cylinder."""

PAGES: dict[str, Arrangement] = {
    "README.md": Arrangement(
        rewritten={r"^make demo": "make -o setup demo"},  # set-up is tried on a bare machine
        not_run={r"^make test": "it is what runs this"} | WHEEL,
        slow=(r"^make",),
    ),
    "docs/affordances.md": Arrangement(slow=(r"manitwin affordances",)),
    "docs/audit.md": Arrangement(
        exits={r"PATH\.\.\.": 1, "--fix": 1, "--engine": 1}, slow=(r"--fix", r"baseline", r"--engines")
    ),  # the mug there is wrong: its collision shape fills it
    "docs/audit_in_ci.md": Arrangement(blocks={"^repos:": "hooks", "^on: ": "workflow"}),
    "docs/backends.md": Arrangement(blocks={"entry-points": "entry_point"}, slow=(DOCTOR,)),
    "docs/build.md": Arrangement(
        blocks={"^file,name,units": "manifest", "^file,name,group": "manifest", "^things: ": "account things"}
    ),
    "docs/catalog.md": Arrangement(slow=(r"manitwin catalog",)),
    "docs/cluster.md": Arrangement(
        rewritten={r" --address auto": ""},  # without one, it starts a cluster on this machine
        not_run={r"^pip install": NO_NETWORK},
    ),
    "docs/collect.md": Arrangement(
        rewritten={
            r"products\.csv": "list.csv",
            r"^manitwin collect draw plan": "head -4 plan/prompts.csv > few.csv; manitwin collect draw few.csv",
        },
    ),
    "docs/dataset.md": Arrangement(slow=(r"--timeout", r"manitwin index", r"truncate", r"mass_kg < 0\.4\"")),
    "docs/episodes.md": Arrangement(
        not_run={r"^from lerobot": "LeRobot has an environment of its own: make lerobot-real reads such a set with it"},
    ),
    "docs/evaluation.md": Arrangement(slow=(r"evaluate generation",)),
    "docs/export.md": Arrangement(),
    "docs/generators.md": Arrangement(
        rewritten=TRIPOSR,
        not_run=HUNYUAN | {r"^git clone https://github\.com/VAST-AI-Research/TripoSR": NO_NETWORK},
        slow=(DOCTOR,),
    ),
    "docs/imports.md": Arrangement(),
    "docs/json.md": Arrangement(blocks={"nothing_here": "answer manitwin build nothing_here.png -o out --json"}),
    "docs/layouts.md": Arrangement(rewritten={"layout_1_000017": "layout_1_000001"}),
    "docs/locate.md": Arrangement(
        rewritten={r"locate TWIN": "locate $(ls -d DATASET/twins/*/* | head -1)"},
        slow=(r"manitwin locate",),
    ),
    "docs/photos.md": Arrangement(
        # without weights, which only a person adds, each is refused
        rewritten={r"^manitwin models add (isnet|u2net)": r"manitwin models add \1 --from nothing.tgz"},
        slow=(r"manitwin review cutouts",),
        exits={r"^manitwin models add": 2, r"--matting (isnet|my-birefnet)": 2} | NOTHING_DOUBTED,
    ),
    "docs/platforms.md": Arrangement(
        not_run=WHEEL | {r"uv pip compile": NO_NETWORK, r"^docker ": CONTAINER}, slow=(DOCTOR,)
    ),
    "docs/priors.md": Arrangement(blocks={"melon": "prior kitchen"}),
    "docs/programs.md": Arrangement(
        not_run={
            r"^\.venv/bin/python examples/": "tests/examples runs the four in this order, and checks what they print"
        },
    ),
    "docs/publish.md": Arrangement(
        slow=(r"\bOUT(_EPISODES)?\b",), blocks={"^OUT/": "tree OUT", "^OUT_EPISODES/": "tree OUT_EPISODES"}
    ),
    "docs/python.md": Arrangement(
        rewritten={
            r'name="mug"\)': 'name="mug", quick=True)',
            r'"layouts", 20,': '"layouts", 2,',
            r'"demonstrations", 50,': '"demonstrations", 2,',
        },
    ),
    "docs/robots.md": Arrangement(blocks={"my_arm": "robot my_arm/my_arm.toml"}),
    "docs/runs.md": Arrangement(
        rewritten={r" --watch": "", "mug_0042.glb": "mug.glb"},  # watching ends with the watcher
        slow=(r"\bDATASET\b",),
        blocks={"^DATASET/": "tree DATASET"},
    ),
    "docs/real_scene.md": Arrangement(slow=(r".",)),
    "docs/review.md": Arrangement(
        slow=(r"manitwin review (apply|cutouts|tune|import|report|DATASET)", r"--form"), exits=NOTHING_DOUBTED
    ),
    "docs/search.md": Arrangement(
        slow=(r"manitwin search DATASET --image",),
    ),
    "docs/served_grasps.md": Arrangement(not_run=GRASP_SERVERS, slow=(DOCTOR,)),
    "docs/tutorial.md": Arrangement(
        rewritten={r" -n 150 ": " -n12 "},  # of two, as elsewhere, one may fail: there is nothing to train on then
        slow=(r".",),
    ),
    "docs/twin.md": Arrangement(blocks={"^<twin_id>/": "tree twins/twins/*/*"}),
    "docs/upgrading.md": Arrangement(rewritten={r"\bDATASET\b": "twins"}),  # which has a ledger
    "docs/view.md": Arrangement(
        rewritten={r"view TWIN": "view $(ls -d DATASET/twins/*/* | head -1)"}, slow=(r"manitwin view",)
    ),
    "docs/vqa.md": Arrangement(slow=(r"manitwin (layout|vqa)",)),
    "docs/vlm.md": Arrangement(not_run=MODEL_SERVERS, blocks={"services": "settings run.toml"}),
}
