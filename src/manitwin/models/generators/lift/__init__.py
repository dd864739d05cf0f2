"""The built-in generator ``lift``, which needs no weights; ``lifting`` describes how it chooses a shape."""

from manitwin.models.generators.lift.generator import LiftGenerator

__all__ = ["LiftGenerator"]
