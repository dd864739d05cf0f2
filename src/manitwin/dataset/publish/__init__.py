"""Publication of a data set: WebDataset shards by category, Parquet tables and a Hugging Face dataset card."""
