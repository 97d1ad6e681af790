"""What an answer is worth: its values, in several runs of the model, beside those of the key.

Here belong the runs, the values of a student's cells in them, and what an answer must not need.
Nothing here may write a file. Begin with :mod:`kfsheet.coursework.judging.judge`.
"""
