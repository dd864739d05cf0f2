"""Episodes: planned, executed, judged, recorded."""
