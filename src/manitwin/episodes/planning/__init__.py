"""Motion planning of arms among convex obstacles: inverse kinematics, RRT-Connect, time parameterisation, pick-and-place."""
