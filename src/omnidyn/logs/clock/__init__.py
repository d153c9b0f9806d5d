"""Columns that count: clock (time in any form), stamps (seconds and nanoseconds; times far from all others), rate,
counters (encoders that start over), overflow (speeds beyond 16 bits), restarts (what is said, and the gap),
counted_columns (all of a table)."""
