"""What the report proposes, tried: one file for each proposal, on top of the methods.

Each experiment is a function that says what a proposal gains or costs, in metres, pixels or radii.
"""
