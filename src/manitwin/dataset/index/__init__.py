"""The tables of a data set: Parquet parts below ``index/``, written as a run goes and asked with DuckDB."""
