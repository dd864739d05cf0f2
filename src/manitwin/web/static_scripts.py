"""Data files as scripts for static pages, since browsers load scripts from file URLs but neither JSON nor GLB.

Each script sets one entry of ``manitwinFiles`` (stage.js), keyed by the file's path relative to the root folder.
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
"""Path from any page except the first to the root folder."""
NAMES = FileLinks()


def document_script(name: str, document: bytes) -> bytes:
    """Return the script of a JSON document."""
    return b"(globalThis.manitwinFiles??={})[%s]=%s;\n" % (json.dumps(name).encode(), document)


def binary_script(name: str, content: bytes) -> bytes:
    """Return the script of a binary file, in base64."""
    return b'(globalThis.manitwinFiles??={})[%s]="%s";\n' % (json.dumps(name).encode(), base64.b64encode(content))


def write_twin(
    out: Path, twin: Twin, *, player: TrialPlayer | None = None, trials: int = 0, with_gallery: bool = True
) -> int:
    """Write the page of a twin with its files, all or none; return their total bytes.

    With a ``player``, the trials of the first ``trials`` grasps of each gripper, which are far apart, can be played. Raises
    TwinError for a twin that cannot be read completely: static pages must be complete, and must not name local folders in error
    messages.
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
    """Return the script of the trials of the first ``count`` grasps of each gripper shipped with the package."""
    name, scripts = NAMES.file(twin.record.twin_id, trial_document.DOCUMENT, ""), []
    for gripper, columns in document["grasps"].items():
        for grasp_id in columns["id"][:count]:
            try:
                told = player.play(twin, gripper, grasp_id)
            except UsageError:  # for other grippers or engines, the page shows a message per grasp
                break
            scripts.append(document_script(f"{name}?{urlencode({'gripper': gripper, 'grasp': grasp_id})}", told))
    return b"".join(scripts)


def read_file(twin: Twin, name: str) -> bytes:
    """Return the content of a file that a page may have.

    Raises TwinError and UsageError as ``open_file`` does, and TwinError if the file does not match the record's digest.
    """
    content = b"".join(open_file(twin.folder, name).chunks())
    if hashlib.sha256(content).hexdigest() != twin.record.files.get(name):
        raise TwinError(f"{name}: altered or cut off since it was written (its sha256 does not match); {REMEDY}")
    return content


def write(path: Path, content: bytes) -> int:
    """Write a file and its parent folders; return its number of bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return len(content)
