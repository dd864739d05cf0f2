"""Estimators of a known thing's pose in a picture that the user has: FoundationPose, MegaPose and others behind one protocol."""
