"""The command line: arguments in, one line for an error, an exit status out.

Here belongs what a person types and sees in a terminal. Nothing here may compute: a command calls
the package that does. Begin with :func:`kfsheet.cli.commands.main`.
"""
