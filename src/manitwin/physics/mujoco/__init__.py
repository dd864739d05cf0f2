"""MuJoCo: the second, independent engine."""
