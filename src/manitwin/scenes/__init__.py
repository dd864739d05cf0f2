"""Scenes of several twins: layouts, scene files, exports, localization from camera data, perception data and VQA."""
