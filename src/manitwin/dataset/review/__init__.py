"""People judge twins: a sample, queues, verdicts that are never lost, and what they say of a data set."""
