"""What all checks stand on: robust, log_under_check, clocks (rows of one sensor), reference (a channel told by
others)."""
