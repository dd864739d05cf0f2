"""Grasp proposals: where a gripper may hold an object, before any physics."""
