"""Classifiers: what a picture shows, in the words of the priors, with a probability that can be believed."""
