"""Columns that count: clock (time in any form), stamps (seconds and nanoseconds), counters (encoders that wrap)."""
