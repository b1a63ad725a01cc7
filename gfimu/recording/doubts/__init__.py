"""What is doubtful in a recording, judged once: its times, its readings, its unit, order, signs, array and references.

In: times, readings and references of a recording, or columns of a table that is none yet; the array, where one is
known.
Out: `Doubt`s with their kind, severity, rows, channels and remedy, from which every command reports, and the recording
with wrong samples marked as missing.
"""
