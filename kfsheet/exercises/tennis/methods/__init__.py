"""The methods of the workshop report "The Tennis Ball Problem", chapter 3, as a library.

Numbers of sections and equations in the docstrings are the report's. Units are m, s, rad and px.
"""
