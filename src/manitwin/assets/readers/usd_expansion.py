"""How many prims a stage would have: a few lines of references to references can mean more than any memory holds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from pxr import Sdf

_MAX_DEPTH = 300


def composed_prims(root: Sdf.Layer, layers: Mapping[str, Sdf.Layer]) -> int | None:
    """Return an upper bound of the prims that composing ``root`` gives, None where they are nested beyond all use.

    ``layers`` are all layers by identifier. All variants are counted, and what overrides a prim counts as another.
    """
    try:
        return _Expansion(layers).of_stack(root, Sdf.Path.absoluteRootPath, 0)
    except _TooDeep:
        return None


class _TooDeep(Exception):
    """Prims or references nested deeper than ``_MAX_DEPTH``."""


class _Expansion:
    def __init__(self, layers: Mapping[str, Sdf.Layer]):
        self._layers = layers
        self._known: dict[tuple[str, Sdf.Path], int] = {}

    def of_stack(self, layer: Sdf.Layer, path: Sdf.Path, depth: int) -> int:
        """Count below a path in a layer and its sublayers."""
        seen: dict[str, Sdf.Layer] = {}
        waiting = [layer]
        while waiting:
            each = waiting.pop()
            if each.identifier not in seen:
                seen[each.identifier] = each
                waiting += [self._layers[name] for name in each.subLayerPaths if name in self._layers]
        return sum(self._of(each, layer, path, depth) for each in seen.values())

    def _of(self, layer: Sdf.Layer, stack: Sdf.Layer, path: Sdf.Path, depth: int) -> int:
        if depth > _MAX_DEPTH:
            raise _TooDeep
        while not path.IsAbsoluteRootPath() and layer.GetPrimAtPath(path) is None:
            path = path.GetParentPath()  # it lies in what a prim above it refers to
        key = (layer.identifier, path)
        if key not in self._known:
            self._known[key] = 0  # a circle, which USD takes out
            spec = layer.pseudoRoot if path.IsAbsoluteRootPath() else layer.GetPrimAtPath(path)
            self._known[key] = 1 + sum(
                self._of(layer, stack, child.path, depth + 1) for child in _children(spec)
            ) + sum(self.of_stack(*target, depth + 1) for target in self._targets(spec, stack))  # fmt: skip
        return self._known[key]

    def _targets(self, spec: Sdf.PrimSpec, stack: Sdf.Layer) -> Iterator[tuple[Sdf.Layer, Sdf.Path]]:
        """Yield where a prim's references, payloads, inherits and specializes lead; ``stack`` is the root of its layers."""
        for item in [*_items(spec.referenceList), *_items(spec.payloadList)]:
            layer = self._layers.get(item.assetPath) if item.assetPath else stack
            if layer is None:
                continue
            default = Sdf.Path.absoluteRootPath.AppendChild(layer.defaultPrim) if layer.defaultPrim else None
            path = item.primPath or default
            if path is not None:
                yield layer, path
        for path in [*_items(spec.inheritPathList), *_items(spec.specializesList)]:
            yield stack, path


def _children(spec: Sdf.PrimSpec) -> Iterator[Sdf.PrimSpec]:
    yield from spec.nameChildren
    for variants in spec.variantSets.values():
        for variant in variants.variants.values():
            yield variant.primSpec


def _items(edits: Sdf.PathListOp) -> list[Sdf.Reference]:
    return list(edits.GetAddedOrExplicitItems())
