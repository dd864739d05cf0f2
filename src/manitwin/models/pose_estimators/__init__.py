"""Estimators of the 6-DoF pose of a known object in a picture: FoundationPose, MegaPose and others behind one protocol."""
