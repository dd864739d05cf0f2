"""Selection of audit rules by codes and code prefixes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

from manitwin.assets.audit.finding import Rule, RuleText
from manitwin.assets.audit.rules import RULES
from manitwin.errors import UsageError

ALWAYS = frozenset({"FIL001", "FIL005", "FIL006"})
"""Rules on unreadable or unmeasurable assets, which only --ignore removes, because such assets were not audited at all."""


def select_rules(select: Iterable[str] = (), ignore: Iterable[str] = ()) -> tuple[Rule, ...]:
    """Return the rules that are selected and not ignored; all are selected by default.

    Codes are case-insensitive. The longer prefix wins: ``select=["INE001"], ignore=["INE"]`` keeps INE001; for equal length,
    ``ignore`` wins. Raises UsageError for a prefix of no code, naming the closest one.
    """
    chosen, dropped = _prefixes(select), _prefixes(ignore)
    return tuple(rule for rule in RULES if _is_selected(rule.code, chosen, dropped))


def rule_of(code: str) -> Rule:
    """Return the rule of a complete code; raises UsageError naming the closest one."""
    for rule in RULES:
        if rule.code == code.strip().upper():
            return rule
    raise UsageError(_unknown(code.strip().upper()))


def _is_selected(code: str, chosen: Sequence[str], dropped: Sequence[str]) -> bool:
    default = 0 if not chosen or code in ALWAYS else -1
    longest_chosen = max((len(prefix) for prefix in chosen if code.startswith(prefix)), default=default)
    longest_dropped = max((len(prefix) for prefix in dropped if code.startswith(prefix)), default=-1)
    return longest_chosen > longest_dropped


def _prefixes(words: Iterable[str]) -> list[str]:
    prefixes = [word.strip().upper() for word in words if word.strip()]
    for prefix in prefixes:
        if not any(rule.code.startswith(prefix) for rule in RULES):
            raise UsageError(_unknown(prefix))
    return prefixes


def _unknown(code: str) -> str:
    codes = [rule.code for rule in RULES]
    families = list(dict.fromkeys(code[:3] for code in codes))
    near = get_close_matches(code, [*codes, *families], n=1, cutoff=0.5)
    hint = f"did you mean {near[0]}? " if near else ""
    return f"no rule's code is or begins with {code!r}; {hint}Valid beginnings: {', '.join(families)}"


def selected_texts(select: Sequence[str], ignore: Sequence[str]) -> tuple[RuleText, ...]:
    """Return the descriptions of the rules that ``select_rules`` returns."""
    return tuple(rule.text for rule in select_rules(select, ignore))
