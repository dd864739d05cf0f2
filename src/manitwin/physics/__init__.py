"""Rigid-body simulation: trials of grasps, robustness, settling."""
