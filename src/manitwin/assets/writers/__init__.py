"""Exporters of twins to the formats of simulators and other tools."""
