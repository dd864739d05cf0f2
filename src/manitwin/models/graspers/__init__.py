"""Grasp proposals: poses of a gripper that may hold an object, before any physics trial."""
