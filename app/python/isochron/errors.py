"""What goes wrong."""


class InputError(ValueError):
    """What was given cannot be used: one line, the same that the command prints, with file, line, column and key where a file
    is to blame."""
