"""What came back, hostile until read.

Here belong the roster, the files, whose they are, the cells of a worksheet within limits, and where
the answers stand. Nothing here may say whether an answer is right.
Begin with :func:`kfsheet.coursework.reading.submission.read_submission`.
"""
