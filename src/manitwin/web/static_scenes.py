"""Static pages of scenes: the list, a 3D view of each scene, and the pages of their twins."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from manitwin.errors import UsageError
from manitwin.scenes.scene import SceneRecord
from manitwin.web.html import SCENE_VIEWER
from manitwin.web.links import FileLinks, list_name
from manitwin.web.scene_document import DOCUMENT, scene_document
from manitwin.web.scene_folders import SceneFolders
from manitwin.web.scene_pages import PAGE_SCENES, list_page, scene_page
from manitwin.web.static_scripts import NAMES, UP, document_script, write
from manitwin.web.static_twins import WrittenPages
from manitwin.web.twin_document import document_bytes
from manitwin.web.twin_page import SCRIPTS

DATA_SCRIPT = "scene_view.js"


def write_scenes(
    out: Path, scenes: SceneFolders, scene_ids: Sequence[str], title: str, on_page: Callable[[str], None]
) -> WrittenPages:
    """Write the pages of some scenes to a folder; scenes with missing twins are left out."""
    done, links = WrittenPages((*SCRIPTS, SCENE_VIEWER)), FileLinks(UP)
    found: dict[str, tuple[SceneRecord, list[str]]] = {}
    for scene_id in scene_ids:
        whole = done.run_or_record(scene_id, partial(_write_data, out, scenes, scene_id, done))
        if whole is not None:
            found[scene_id] = whole
        on_page(scene_id)
    ids, records = list(found), [record for record, _ in found.values()]
    for place, (scene_id, (record, models)) in enumerate(found.items()):
        before, after = (ids[place - 1] if place else None), (ids[place + 1] if place + 1 < len(ids) else None)
        page = scene_page(record, links, before, after, data=[DATA_SCRIPT, *models])
        done.size_bytes += write(out / "scenes" / scene_id / "index.html", page.encode())
    done.pages = len(records)
    for start in range(0, len(records), PAGE_SCENES) or [0]:
        shown = records[start : start + PAGE_SCENES]
        page = list_page(shown, start, len(records), title, FileLinks())
        done.size_bytes += write(out / list_name(start), page.encode())
    return done


def _write_data(out: Path, scenes: SceneFolders, scene_id: str, done: WrittenPages) -> tuple[SceneRecord, list[str]]:
    """Write a scene's document and its twins; return its record and the relative URLs of the scripts with their meshes."""
    record = scenes.scene(scene_id)
    models = done.write_twins(out, scenes.twins, (each.twin_id for each in record.objects))
    document = scene_document(record, scenes.twins, FileLinks(UP))
    if document["unreadable"]:
        raise UsageError(document["unreadable"][0])
    script = document_script(NAMES.scene(scene_id, DOCUMENT), document_bytes(document))
    done.size_bytes += write(out / "scenes" / scene_id / DATA_SCRIPT, script)
    return record, models
