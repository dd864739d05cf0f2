"""Models that draw a picture of a text, behind the protocol of generators: submit, poll, fetch."""
