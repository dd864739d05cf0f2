"""What a name says of a thing's shape, by its category's prior."""

from __future__ import annotations

from dataclasses import dataclass

from manitwin.models.annotators.priors import Prior, lookup


@dataclass(frozen=True)
class ShapeHint:
    """``stands``: put down upright (None: unknown); ``container``: open at the top; the others describe its shape.

    ``volume_share`` is the usual volume of its matter over the cube of the usual longest side.
    """

    stands: bool | None = None
    container: bool = False
    round: bool = False
    boxy: bool = False
    flat: bool = False
    volume_share: float | None = None


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
        volume_share=_volume_share(prior),
    )


def _volume_share(prior: Prior) -> float | None:
    """Return the volume of a category's things by their mass, over the cube of their length; None for hollow ones."""
    density = prior.bulk_density_kg_m3
    if density is None or prior.container:
        return None
    return prior.mass_kg.typical / density.typical / prior.longest_axis_m.typical**3
