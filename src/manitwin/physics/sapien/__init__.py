"""SAPIEN (PhysX) simulations: bodies, hands, grasp trials, settling, and robot worlds."""
