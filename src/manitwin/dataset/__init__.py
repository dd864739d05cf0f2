"""Many twins: index, queries, statistics, publication."""
