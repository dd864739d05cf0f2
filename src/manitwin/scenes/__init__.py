"""Scenes of several twins: layouts, files, exports."""
