"""Tables of numbers, and what it takes to read one from text.

table (the value), text_file (lines in blocks), dialect (separator, cells, numbers),
header (names, units), rows (cells to numbers), decimals (what a point means where a comma may be decimal).
preamble: what stands above the names of columns.
"""
