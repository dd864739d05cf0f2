"""Moving parts of an asset: their arrangement at loading and over the ranges of their joints."""
