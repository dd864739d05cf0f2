"""Trained models and hosted services behind small protocols, with built-in defaults that need no weights and no API key."""
