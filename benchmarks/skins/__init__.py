"""What a person waits for: first_minutes at the command line, studio and studio_log in a browser. studio_kills: what is
said of a process that ends.
"""
