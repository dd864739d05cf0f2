"""Rigid-body simulation: grasp trials, robustness tests, settling of bodies and scenes, and robot worlds."""
