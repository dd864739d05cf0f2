"""Collection of errors in inputs, so that all of them are reported at once and a long list can be corrected in one pass."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from manitwin.errors import UsageError
from manitwin.formats.printable import printable_line

TOLD = 8
"""Number of errors reported with their reason besides the first, which is reported in full; of the rest only row numbers."""
ROWS_NAMED = 200
MOST = 1000
"""Number of errors at which reading stops, as the list is hardly the intended one."""
_CHARACTERS = 200


@dataclass
class RefusedInputs:
    """The messages on unusable inputs, each starting with its location."""

    lines: list[str] = field(default_factory=list)

    @contextmanager
    def noted(self) -> Iterator[None]:
        """Collect a UsageError, so that the next input is read too; on reaching ``MOST``, raise one UsageError for all."""
        try:
            yield
        except UsageError as error:
            if len(self.lines) >= MOST:  # raised for all inputs already
                raise
            self.lines.append(str(error))
        if len(self.lines) >= MOST:
            self.tell()

    def tell(self) -> None:
        """Raise UsageError for all collected errors: the first in full, the others up to their first semicolon."""
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
