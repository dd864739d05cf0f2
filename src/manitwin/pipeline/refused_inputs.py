"""What is wrong with inputs, told of all of them at once: who lists 10,000 things corrects their list in one go."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from manitwin.errors import UsageError
from manitwin.formats.printable import printable_line

TOLD = 8
"""So many are told with their reason besides the first, which is told whole; of the rest where they stand, if in rows."""
ROWS_NAMED = 200
MOST = 1000
"""A list with so many is not the one that was meant: the rest of it is not read."""
_CHARACTERS = 200


@dataclass
class RefusedInputs:
    """The inputs that cannot be used, by what is wrong with each; a line begins with where it stands."""

    lines: list[str] = field(default_factory=list)

    @contextmanager
    def noted(self) -> Iterator[None]:
        """Keep a UsageError for later, so that the next input is looked at too; the last of ``MOST`` raises one of all."""
        try:
            yield
        except UsageError as error:
            if len(self.lines) >= MOST:  # of all already
                raise
            self.lines.append(str(error))
        if len(self.lines) >= MOST:
            self.tell()

    def tell(self) -> None:
        """Raise UsageError where there is any, in one line: the first whole, the others as far as their first semicolon."""
        if not self.lines:
            return
        first, *others = self.lines
        if not others:
            raise UsageError(first)
        told = [printable_line(line.split("; ")[0], max_characters=_CHARACTERS) for line in others[:TOLD]]
        if rest := others[TOLD:]:
            told.append(f"and {len(rest):,} more{_rows(rest)}")
        unread = "; the inputs after them were not read" if len(self.lines) >= MOST else ""
        raise UsageError(f"{first}. {len(others):,} more cannot be used: {'; '.join(told)}{unread}")


def _rows(lines: list[str]) -> str:
    rows = [row for line in lines if (row := line.split(": ")[0].rsplit(":")[-1]).isdigit()]
    if not rows:
        return ""
    return f" in rows {', '.join(rows[:ROWS_NAMED])}{', ...' if len(rows) > ROWS_NAMED else ''}"
