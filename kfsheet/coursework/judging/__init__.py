"""What an answer is worth, and what kind of mistake is in it.

Here belong the meaning of a cell, the points at which it is compared with the key, and the names of
mistakes. Nothing here may write a file. Begin with :mod:`kfsheet.coursework.judging.judge`.
"""
