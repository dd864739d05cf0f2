"""Robot models: arms from URDF, grippers from TOML files, and the kinematics and collision data for planning and simulation."""
