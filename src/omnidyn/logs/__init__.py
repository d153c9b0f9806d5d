"""What was measured: files of any kind to Runs, and stretches of them.

read_log is the door, log what a file holds by channel (channels, column); on the way: readers/ (formats), table/
(text), columns/ (which column is what), clock/ (time and counters). Then what is made from a Run: segments, plateaus,
resolved. Other files with a fixed form: run_file, command_file, steady_table.
"""
