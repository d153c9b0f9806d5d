"""Tab Compare: robots and fits against the logs, and fits of one robot beside each other. Read job, state, then tab."""
