"""The ledger of a run: what became of every item and every stage, in one SQLite file that only the driver writes."""
