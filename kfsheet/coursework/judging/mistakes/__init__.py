"""What a wrong answer is called, and what it is worth all the same.

Here belong the statuses of answers, the mistakes that students make, and how one is told from
another by its values. Nothing here may say whether an answer is right. Begin with
:mod:`kfsheet.coursework.judging.mistakes.diagnosis`.
"""
