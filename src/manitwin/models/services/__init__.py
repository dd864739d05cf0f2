"""Clients of HTTP services: keys, retries, limits, and translation of service errors."""
