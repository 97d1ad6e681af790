"""Many runs of a recurrence, and what they say together.

Here belong draws, statistics over members, NEES, the source that computes all members at once, and
who computes which members. Nothing here may keep the rows of every member: memory does not grow
with their number. Begin with :func:`kfsheet.ensemble.study.study`, which reads downwards.
"""
