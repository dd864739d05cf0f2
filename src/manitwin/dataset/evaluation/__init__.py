"""Evaluation of data sets against ground-truth labels and the paper's figures, with confidence intervals."""
