"""Index of a data set: Parquet tables below ``index/``, written during a run and queried with DuckDB."""
