"""The error base class of every package: what a caller catches once, at the entry point."""


class FgbaselineError(Exception):
    """Something that a user can mend. Its text is one sentence: what is wrong, where, and what to do."""


class InputError(FgbaselineError):
    """A file or a value given by the user is not what it should be."""
