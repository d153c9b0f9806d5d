"""A Run in formats that other programs read: mcap_run (MCAP with the messages of ROS 2), cdr (how they are packed),
mat_run (MATLAB). CSV and Parquet stand in run_file, which is the door to all."""
