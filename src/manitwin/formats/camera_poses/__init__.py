"""Readers of camera poses and lenses, as written by programs that estimate or render them."""
