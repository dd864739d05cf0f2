"""Assets of other tools: read as they are, written, audited."""
