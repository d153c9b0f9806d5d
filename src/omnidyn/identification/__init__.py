"""From logs to a robot with intervals.

methods (a type each, with its options; default_method: which one where none is asked for) and grouping (whose logs
belong together; none counts twice) are what is asked; identify is the door, estimate the answer of a group,
identification all of it, verdict what it came to, log_verdicts what `check` says of its logs. Methods: output_error/
(whole logs, with the ladder by whole_logs), steady/ (stretches of constant speed), motors/ (a motor on a bench).
selection/ says whether one more effect predicts held-out blocks better. Then structure/ (is the model right? its
answers: lack_of_fit, stability), validation (free runs beside the logs), force_scale (what no log can correct),
friction_curve (force against speed), ladder (its steps as values), advice (what to do next), and fit_document (all of
it as tables and words). planning/ says which experiment tells most, live/ what a log
tells while it grows. first_runs makes whatever the compiler is needed for.
fingerprints: whether two logs are one recording. origin: what a result was made from.
"""
