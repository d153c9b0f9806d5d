"""One file per format: parquet (with parquet_pages), and any_table, which tells them by their content."""
