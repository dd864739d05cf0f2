"""What twins are used for: one folder an application of the paper."""
