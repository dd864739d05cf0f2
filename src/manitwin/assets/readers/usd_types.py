"""Values of a USD file that are not of the type that their schema gives them: reading them would read something else."""

from __future__ import annotations

import re

from pxr import Sdf, Usd

from manitwin.errors import AssetError
from manitwin.formats.meshes.source import MeshSource


def check_types(prim: Usd.Prim, source: MeshSource) -> None:
    """Raise AssetError where a value is not of the type that its schema gives it, precision apart."""
    definition = prim.GetPrimDefinition()
    for name in definition.GetPropertyNames():
        attribute = prim.GetAttribute(name)
        if not attribute or not attribute.HasAuthoredValue():
            continue
        wanted = _kind(definition.GetAttributeDefinition(name).GetTypeName())
        for spec in attribute.GetPropertyStack(Usd.TimeCode.Default()):
            written = spec.typeName if isinstance(spec, Sdf.AttributeSpec) else "relationship"
            if written == "relationship" or _kind(written) != wanted:
                raise AssetError(f"{source.path}: {attribute.GetPath()} is a {written}, not a {wanted}; mend it")


def _kind(name: Sdf.ValueTypeName) -> str:
    """Return a value type without its precision: ``float`` for ``double``, ``half`` and ``float``."""
    bare = str(name.type.typeName).replace("pxr_half::", "").replace("TfToken", "string")
    return re.sub(r"(GfVec\d|GfQuat|GfMatrix\d)[dfh]", r"\1", re.sub(r"\b(?:double|half)\b", "float", bare))
