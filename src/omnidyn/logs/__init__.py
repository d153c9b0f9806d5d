"""What was measured: files of any kind to Runs, and stretches of them.

read_log is the door, log what a file holds by channel (channels, column); on the way: readers/ (formats), table/
(text), columns/ (which column is what), clock/ (time and counters). Then what is made from a Run: segments, plateaus,
resolved, path (where it went), geometry (where the wheels stand). info: what a file holds, before. Other files with a
fixed form: run_file, mcap_run, command_file, steady_table, motor_table.

Words: a segment lies between two gaps in time, a hold is a stretch over which the commands stand still, a plateau a
steady window as one point, a window so many rows or seconds; a block is a part of a long file, read at once. Readers
leave notes (what was decided) and doubts (what was left open); a Run and an Estimate carry them as warnings.
growing: a text file that is still being written.
cdr: messages of ROS 2 as bytes.
wheel_table: what wheels make of the speeds that they are asked for.
joined_files: several files as one table.
window_means: speeds that are means over a window.
mat_file: a Run as a MATLAB file.
sensor_rows: a run in the rows of one sensor.
"""
