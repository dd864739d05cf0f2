"""Robots as data: an arm from a URDF, a gripper from its TOML file, and what both need to be planned for and simulated."""
