"""Bags of ROS 1 and ROS 2, and MCAP: messages with clocks of their own.

bags (the readers) <- one file per container: mcap_file, .. (each yields messages, and says where it is damaged),
pack (decompression within bounds) -> messages (topic by topic), which knows definitions (text to fields), layout (where
the numbers lie), usual (what the usual messages say of a robot) and clocks (which times can be trusted).
"""
