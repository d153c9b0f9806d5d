"""Tables of numbers in a text file, strictly read.

text (lines in pieces), dialect (separator, cells, numbers), spaced (columns between blanks), decimals (a decimal
comma), header (names, units), rows (cells to numbers), table (all of it).
"""
