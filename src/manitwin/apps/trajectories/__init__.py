"""Manipulation data (paper, Manipulation Data Generation and Cross-Embodiment Data): demonstrations planned and proven."""
