"""Tab Log: a log, its signals with what was found in them, its columns. Read job, then tab."""
