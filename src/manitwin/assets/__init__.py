"""Object assets of other tools: reading without changes, import, audit and export."""
