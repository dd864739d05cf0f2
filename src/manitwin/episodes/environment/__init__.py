"""Gymnasium environment of a task."""
