"""Columns that count: clock (time in any form), stamps (seconds and nanoseconds; times far from all others; time by the
rate of rows), counters (encoders that start over), block_angles
(the same from block to block), widened (speeds beyond 16 bits), restarts (what is said, and
the gap). row_rate: times of a file from the rate of its rows. counted_columns: the columns that count."""
