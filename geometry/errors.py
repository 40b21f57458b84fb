"""Error base class of all packages, caught once at the entry point."""


class FgbaselineError(Exception):
    """Error that a user can correct. Its text is one sentence: what is wrong, where, and what to do."""


class InputError(FgbaselineError):
    """Invalid file or value given by the user."""
