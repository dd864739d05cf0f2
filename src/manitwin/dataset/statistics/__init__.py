"""The statistics of a data set: tables by SQL over its index, their figures, and one HTML report of both."""
