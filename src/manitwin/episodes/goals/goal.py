"""Goal language: a goal is a conjunction of literals to achieve and of literals to preserve."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from manitwin.errors import UsageError, unknown_name_message


@dataclass(frozen=True)
class Signature:
    """Signature of a predicate: kind of its second argument, and unit and default of its value; None: it has none.

    ``second`` is ``object`` (another object of the scene), ``fixture`` (a peg, a plate) or ``place`` (a marked position).
    """

    second: str | None = None
    unit: str | None = None
    default: float | None = None


SIGNATURES: Mapping[str, Signature] = {
    "on": Signature("object"),
    "in": Signature("object"),
    "left_of": Signature("object"),
    "right_of": Signature("object"),
    "behind": Signature("object"),
    "in_front_of": Signature("object"),
    "near": Signature("object", "m", 0.10),
    "away_from": Signature("object", "m", 0.15),
    "upright": Signature(),
    "lifted": Signature(None, "m", 0.05),
    "touching": Signature("object"),
    "undisturbed": Signature(),
    "pushed_to": Signature("place", "m", 0.02),
    "hung": Signature("fixture"),
    "inserted": Signature("fixture", "m", 0.03),
    "poured": Signature("object", "share", 0.9),
    "pressed": Signature(None, "N", 5.0),
    "struck": Signature("object", "m/s", 0.15),
    "stirred": Signature("object", "share", 0.75),
    "wiped": Signature("place", "share", 0.8),
    "cut_motion": Signature("place", "share", 0.8),
    "aimed": Signature("object", "rad", 0.15),
    "handed_over": Signature(None, "m", 0.05),
}
"""All predicates of the language; ``docs/skills.md`` specifies what each measures."""


@dataclass(frozen=True)
class Literal:
    """A predicate applied to an object: ``in(object_00, object_01)``, ``near(object_00, object_02, 0.1)``."""

    predicate: str
    subject: str
    second: str | None = None
    value: float | None = None

    def __post_init__(self) -> None:
        """Fill in the default value; raises UsageError for an unknown predicate or invalid arguments."""
        signature = SIGNATURES.get(self.predicate)
        if signature is None:
            raise UsageError(unknown_name_message("predicate", self.predicate, SIGNATURES))
        if (self.second is None) != (signature.second is None):
            wants = f"needs a second argument, a {signature.second}" if signature.second else "takes one argument"
            raise UsageError(f"{self.predicate} {wants}: {self.subject}, {self.second}")
        if self.second is not None and self.second == self.subject:
            raise UsageError(
                f"{self.predicate}({self.subject}, {self.second}): needs two different objects; name another second"
                f" object"
            )
        if signature.unit is None and self.value is not None:
            raise UsageError(f"{self.predicate} takes no value; leave out {self.value:g}")
        if signature.unit is not None and self.value is None:
            object.__setattr__(self, "value", signature.default)
        if self.value is not None and not 0 <= self.value < 1e6:
            raise UsageError(f"{self.predicate}: a value of {self.value:g} {signature.unit}; give one from 0")

    def __str__(self) -> str:
        arguments = [self.subject, *([self.second] if self.second else [])]
        if self.value is not None:
            arguments.append(f"{self.value:g}")
        return f"{self.predicate}({', '.join(arguments)})"

    def to_json(self) -> dict[str, Any]:
        """Return the fields that are set."""
        said = {
            "predicate": self.predicate,
            "subject": self.subject,
            "second": self.second,
            "value": self.value,
        }
        return {name: value for name, value in said.items() if value is not None}


@dataclass(frozen=True)
class Goal:
    """``literals`` must all become true and none may be true at the start; ``stays`` must still be true at the end."""

    literals: tuple[Literal, ...]
    stays: tuple[Literal, ...] = ()

    def __post_init__(self) -> None:
        """Raise UsageError for an empty goal or a repeated literal."""
        if not self.literals:
            raise UsageError("the goal has no literal; give one or more")
        everything = self.literals + self.stays
        if len(set(everything)) != len(everything):
            raise UsageError(f"the goal repeats a literal: {self}; give each once")

    def __str__(self) -> str:
        stays = f", with {' and '.join(map(str, self.stays))}" if self.stays else ""
        return " and ".join(map(str, self.literals)) + stays

    def to_json(self) -> dict[str, Any]:
        """Return the goal as plain values."""
        return {
            "literals": [each.to_json() for each in self.literals],
            "stays": [each.to_json() for each in self.stays],
        }

    @classmethod
    def from_json(cls, said: Mapping[str, Any]) -> Goal:
        """Read the output of ``to_json``; raises UsageError for anything else."""
        try:
            unknown = sorted(set(said) - {"literals", "stays"})
            if unknown:
                raise UsageError(f"the goal has unknown fields: {', '.join(unknown)}; valid: literals, stays")
            return cls(tuple(map(_literal, said["literals"])), tuple(map(_literal, said.get("stays", ()))))
        except (TypeError, KeyError, AttributeError) as error:
            raise UsageError(f"not a goal ({error!r}); give {{literals: [{{predicate, subject, ...}}]}}") from error


def _literal(said: Mapping[str, Any]) -> Literal:
    fields: dict[str, Any] = {name: said.get(name) for name in ("predicate", "subject", "second", "value")}
    unknown = sorted(set(said) - set(fields))
    if unknown:
        raise UsageError(f"the literal has unknown fields: {', '.join(unknown)}; valid: {', '.join(fields)}")
    for name in ("predicate", "subject", "second"):
        if not isinstance(fields[name], str) and not (name == "second" and fields[name] is None):
            raise UsageError(f"a literal whose {name} is {fields[name]!r}; give a text")
    value = fields["value"]
    if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
        raise UsageError(f"a literal whose value is {value!r}; give a number")
    return Literal(fields["predicate"], fields["subject"], fields["second"], None if value is None else float(value))
