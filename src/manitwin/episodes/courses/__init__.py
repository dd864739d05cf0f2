"""What the robot does in an episode, from the plan to the last motion: a course for each kind of skill, of shared parts."""
