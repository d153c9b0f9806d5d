"""What every command shares: streams (out and err), telling (a result), numbers, session (provenance), progress,
flags (options as the library names them).

What commands write beside a result: pictures, folder.
"""
