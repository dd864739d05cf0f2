"""3MF archives made by hand: a model, and what lies beside it."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import trimesh

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
MATERIAL = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
CONTENT_TYPES = (
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
)
RELATIONSHIPS = (
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="a" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
    "</Relationships>"
)


def model(resources: str, items: str = '<item objectid="1"/>', attributes: str = 'unit="millimeter"') -> str:
    """Return a model document of resources and of what is built."""
    return (
        f'<?xml version="1.0" encoding="UTF-8"?><model {attributes} xmlns="{CORE}" xmlns:m="{MATERIAL}" '
        f'xmlns:p="{PRODUCTION}"><resources>{resources}</resources><build>{items}</build></model>'
    )


def mesh_object(
    number: int, mesh: trimesh.Trimesh, *, attributes: str = "", properties: list[str] | None = None
) -> str:
    """Return an object of a mesh; ``properties`` are the attributes of each triangle."""
    vertices = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in np.asarray(mesh.vertices).tolist())
    given = properties or [""] * len(mesh.faces)
    triangles = "".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}" {each}/>'
        for (a, b, c), each in zip(mesh.faces.tolist(), given, strict=True)
    )
    return (
        f'<object id="{number}" {attributes}><mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>'
        "</object>"
    )


def archive(document: str | bytes, beside: dict[str, str | bytes] | None = None) -> bytes:
    """Return the archive of a model and of other parts by name."""
    stream = io.BytesIO()
    parts = {"[Content_Types].xml": CONTENT_TYPES, "_rels/.rels": RELATIONSHIPS, "3D/3dmodel.model": document}
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, content in {**parts, **(beside or {})}.items():
            packed.writestr(name, content)
    return stream.getvalue()
