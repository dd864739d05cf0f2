"""MuJoCo simulations: grasp trial, settling, and articulated bodies, as the second, independent engine."""
