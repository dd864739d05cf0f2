"""What the name of a thing says of its shape: a hint only, the silhouette decides."""

from __future__ import annotations

from dataclasses import dataclass

from manitwin.models.annotators.priors import lookup


@dataclass(frozen=True)
class ShapeHint:
    """``stands``: put down upright (None: unknown); ``container``: open at the top; the others describe its shape."""

    stands: bool | None = None
    container: bool = False
    round: bool = False
    boxy: bool = False
    flat: bool = False


def hint_from_name(name: str | None) -> ShapeHint:
    """Return the hint of the prior that ``name`` finds; an empty hint where it finds none."""
    prior = lookup(name)
    if prior is None:
        return ShapeHint()
    words = prior.shape.replace("-", " ").split()
    return ShapeHint(
        stands=prior.stands,
        container=prior.container,
        round=bool({"cylindrical", "round", "bottle", "bowl"} & set(words)),
        boxy=bool({"box", "rectangular", "block"} & set(words)),
        flat=bool({"flat", "shallow"} & set(words)),
    )
