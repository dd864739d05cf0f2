"""Scenes of several twins: the scene file, and the way into simulators and pictures."""
