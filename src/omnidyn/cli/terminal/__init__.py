"""What every command shares: streams (out and err), telling (a result), numbers, session (provenance), progress.

What commands write beside a result: pictures, folder.
"""
