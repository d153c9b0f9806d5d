"""What every command shares: streams (out and err), telling (a result), numbers, session (provenance), progress,
flags (options as the library names them).

What commands write beside a result: pictures, folder. What only some ask: help (in groups), identify_options, sizes
(that no robot has), held_key.
"""
