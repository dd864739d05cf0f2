"""Figures of the report, drawn from query results."""
