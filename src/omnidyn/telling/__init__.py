"""What results say, in words: the only room where a number becomes a sentence.

sentence: a Statement in words, and its remedy; small_words: of several rooms. `codes` lists all statements: one file
per room below, each a table `SENTENCES` of code -> Sentence: model, logs, findings, fit, steady, lines, live, driving,
motors, lack_of_fit, causes, verdicts, advice, comparison, control, campaigns. Read sentence.py first, then the file of
the room. log_verdict lays out what `check` prints.
"""
