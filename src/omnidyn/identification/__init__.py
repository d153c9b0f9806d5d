"""From logs to a robot with intervals.

methods (a type each, with its options) and grouping (whose logs belong together; none counts twice) are what is asked;
identify is the door, estimate the answer of a group, Identification all of it. Methods: output_error/ (whole logs, with
the ladder by whole_logs), steady/ (stretches of constant speed), motors/ (a motor on a bench). selection/ says whether
one more effect predicts held-out blocks better. Then structure/ (is
the model right? its answers: lack_of_fit, stability), validation (free runs beside the logs), advice (what to do next),
and fit_document (all of it as tables and words). first_runs makes whatever the compiler is needed for.
"""
