"""Image classifiers: the name of the object in a picture, in the vocabulary of the priors, with a calibrated probability."""
