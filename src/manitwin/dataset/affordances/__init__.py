"""Affordance data sets: grasp, function and part labels on points of twin surfaces."""
