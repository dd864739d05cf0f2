"""Data sets of twins: build, index, query, search, statistics, evaluation, review and publication."""
