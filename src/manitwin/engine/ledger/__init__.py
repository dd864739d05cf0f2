"""The ledger of a run: the state of every item and stage, in one SQLite file that only the driver writes."""
