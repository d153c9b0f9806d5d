"""What all checks stand on: robust, log_under_check, reference (a channel told by others)."""
