"""Motion planning for one arm among convex obstacles: inverse kinematics, RRT-Connect, timing, and the pick-and-place task."""
