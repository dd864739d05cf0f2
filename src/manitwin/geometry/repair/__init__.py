"""Repair of triangle soups to watertight, outward-oriented solids."""
