"""A Run in formats that other programs read: mcap_run (MCAP with the messages of ROS 2). CSV, Parquet
and MATLAB stand in run_file, which is the door to all."""
