"""One file or room per format: text, listed (a row for every value), parquet (with parquet_pages), lerobot, ros (bags,
MCAP), wpilib (wpilog), matlab; folders (a log in several files). read_table tells them by content, reader is the
contract. Where topics have clocks of their own: recording (what a file holds, to Tables) and claims (which topic gives
a component).

The contract of a reader, the value `Reader` of its file, entered in `READERS` of read_table:

1. `kind` is the name that `files.file_format` gives such a file by its first bytes.
2. `tables(path, rows, options)` yields Tables in the order of the file, at most `rows` rows each and MAX_CELLS cells:
   memory is bounded by the block, never by the file. All have the same columns, and the notes so far.
3. The last Table it yields has no rows, the sha256 of the file and all notes.
4. A column is floats, NaN where a value is missing, or words; no number is infinite. A row that cannot be read is
   refused with its place, or left out and counted where `options.skip_bad_rows`.
5. Units and long names go to `Table.units` and `Table.titles` where the file has them; nothing is converted but to
   seconds. What was decided is said in the notes, what is doubtful refused: nothing is guessed.
6. Where topics have clocks of their own, a row is a stamp, blank in the columns of topics that have nothing there, in
   the order of time, and `Table.own_clocks` is set: commands are held, measurements stay where they were taken.
   `Recording` makes such tables; what a format itself says of a column stands in `Table.says`.
7. A file that is cut short, hostile or not what its name says is an InputError with the remedy, never more memory
   than `options.max_bytes` and never a crash; a missing library is a MissingExtraError with the line that installs it.
left_out: records that cannot be used.
spaced_text: columns separated by spaces.
wpilib_structs: struct values of WPILib.
"""
