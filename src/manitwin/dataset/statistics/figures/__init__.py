"""The figures of the report, drawn from the rows of its queries."""
