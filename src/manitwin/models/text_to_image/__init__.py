"""Text-to-image models, behind the protocol of generators: submit, poll, fetch."""
