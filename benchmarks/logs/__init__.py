"""What was measured, and whether it is fit for use: check with its faults (check_faults), compare, stagger (clocks of
their own), big_log, big_bag, fuzz_readers.
"""
