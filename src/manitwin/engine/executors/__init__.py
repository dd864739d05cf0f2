"""Executors that run the jobs of the engine: process pools on this machine, or a Ray cluster."""
