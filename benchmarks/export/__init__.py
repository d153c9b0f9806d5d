"""A robot in the files of other tools: exports (read back by exports_read), exported_c, exported_robots."""
