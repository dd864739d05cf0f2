"""A data set as others download it: WebDataset shards by category, Parquet tables and the hub's dataset card."""
