"""What every command shares: streams (out and err), telling (a result), numbers, session (provenance), progress,
flags (options as the library names them).

How a command ends: outcome. What commands write beside a result: pictures, folder.
"""
