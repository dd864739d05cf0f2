"""Manipulation skills: each module defines who can take part, the goal, and the target's goal poses or its path."""
