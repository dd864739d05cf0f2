"""Models that others trained or serve, behind small protocols, with built-in defaults that need no weights and no key."""
