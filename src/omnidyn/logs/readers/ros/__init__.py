"""Bags of ROS 1 and ROS 2, and MCAP: messages with clocks of their own.

bags (the readers) <- one file per container: mcap_file, bag1_file, db3_file (each yields messages, and says where it is
damaged), pack (decompression within bounds) -> messages (topic by topic), which knows layout (definitions to fields,
where the numbers lie), usual (what the usual messages say of a robot) and clocks (which times can be trusted).

Read here and not by rosbags 0.11: an MCAP of 100 MB takes 105 MB/s of processor time, by rosbags 35 MB/s with nothing
kept; of that file cut at two thirds two thirds of the messages are read, by rosbags none; a bomb of 15 kB takes
rosbags 1.9 GB of memory, and is refused here before it is unpacked (`python3 dev.py bench big_bag`).
definitions: message definitions.
"""
