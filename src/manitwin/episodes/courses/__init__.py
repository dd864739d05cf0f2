"""Courses of episodes: planning and execution of one skill, a class for each kind of skill."""
