"""Scripts that hold what a server would be asked for: browsers read no JSON and no GLB from the address of a file, but scripts.

Each sets one name of ``manitwinFiles`` (stage.js): the file's path below the folder of all.
"""

from __future__ import annotations

import base64
import hashlib
import json
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from manitwin.errors import TwinError, UsageError
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import REMEDY
from manitwin.web import trial_document, twin_document
from manitwin.web.links import FileLinks
from manitwin.web.served_files import CARD, MODEL, VIEWS, open_file
from manitwin.web.trial_player import TrialPlayer
from manitwin.web.twin_page import DATA_SCRIPT, MODEL_SCRIPT, TRIALS_SCRIPT, twin_page

UP = "../../"
"""From any page but the first to the folder of all."""
NAMES = FileLinks()


def document_script(name: str, document: bytes) -> bytes:
    """Return the script of a JSON document."""
    return b"(globalThis.manitwinFiles??={})[%s]=%s;\n" % (json.dumps(name).encode(), document)


def binary_script(name: str, content: bytes) -> bytes:
    """Return the script of a file that is no text."""
    return b'(globalThis.manitwinFiles??={})[%s]="%s";\n' % (json.dumps(name).encode(), base64.b64encode(content))


def write_twin(
    out: Path, twin: Twin, *, player: TrialPlayer | None = None, trials: int = 0, with_gallery: bool = True
) -> int:
    """Write the page of a twin with its files, all or nothing of them; returns their bytes.

    With a ``player``, the first ``trials`` grasps of each gripper, which lie far apart, can be played. Raises TwinError for a
    twin that cannot be read whole: what is sent to others is, and names no folder of this machine.
    """
    document = twin_document.twin_document(twin)
    if document["unreadable"]:
        raise TwinError(document["unreadable"][0])
    twin_id, revision = twin.record.twin_id, twin.record.revision
    played = b"" if player is None else _trials(twin, document, player, trials)
    page = twin_page(twin, FileLinks(UP), with_gallery=with_gallery, with_trials=bool(played))
    name = NAMES.file(twin_id, twin_document.DOCUMENT, revision)
    content = {
        "index.html": page.encode(),
        DATA_SCRIPT: document_script(name, twin_document.document_bytes(document)),
        MODEL_SCRIPT: binary_script(NAMES.file(twin_id, MODEL, revision), read_file(twin, MODEL)),
        **({TRIALS_SCRIPT: played} if played else {}),
    }
    named = [name for name in sorted(twin.record.files) if name == CARD or VIEWS.fullmatch(name)]
    content |= {name: read_file(twin, name) for name in named}
    folder = out / "twins" / twin_id
    return sum(write(folder / name, data) for name, data in content.items())


def _trials(twin: Twin, document: dict[str, Any], player: TrialPlayer, count: int) -> bytes:
    """Return the script of the trials of so many grasps of each gripper that comes with the package."""
    name, scripts = NAMES.file(twin.record.twin_id, trial_document.DOCUMENT, ""), []
    for gripper, columns in document["grasps"].items():
        for grasp_id in columns["id"][:count]:
            try:
                told = player.play(twin, gripper, grasp_id)
            except UsageError:  # of a gripper or an engine that is not of the package: the page says so, grasp by grasp
                break
            scripts.append(document_script(f"{name}?{urlencode({'gripper': gripper, 'grasp': grasp_id})}", told))
    return b"".join(scripts)


def read_file(twin: Twin, name: str) -> bytes:
    """Return the content of a file that a page may have.

    Raises TwinError and UsageError as ``open_file`` does, and TwinError for a file that is not the one of the record.
    """
    content = b"".join(open_file(twin.folder, name).chunks())
    if hashlib.sha256(content).hexdigest() != twin.record.files.get(name):
        raise TwinError(f"{name}: altered or cut off since it was written (its sha256 does not match); {REMEDY}")
    return content


def write(path: Path, content: bytes) -> int:
    """Write a file, and the folders that it lies in; returns its bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return len(content)
