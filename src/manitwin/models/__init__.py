"""What someone else trained or serves, each behind a small protocol, with a built-in default that needs no weights and no key."""
