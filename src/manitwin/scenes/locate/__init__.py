"""Localization of twins in camera views: 6D pose from depth, with rejection if the twin does not explain the view."""
