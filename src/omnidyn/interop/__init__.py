"""What other tools of Python read: functions on a Run, so that run.py knows none of them. dataframe: pandas."""
