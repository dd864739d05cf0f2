"""Gripper models (parallel, suction, multi-finger), read from TOML files."""
