"""Local fake servers of third-party services, including their failure modes, for tests and rehearsals without accounts."""
