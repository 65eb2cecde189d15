"""The one error of the project: input that cannot be used."""

import re

_BREAKS = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029]")  # what ends a line, or moves a terminal's cursor


class InputError(ValueError):
    """Input that cannot be used: one line that names the file, the key or photo, and what was expected.

    ``where`` is the file (or ``file: key``) at fault and ``what`` the rule it broke with the offending value.
    """

    def __init__(self, where: object, what: str):
        super().__init__(str(where), what)  # as they came, else it cannot be made again in another process
        self.where = str(where)
        self.what = what

    def __str__(self) -> str:
        return _BREAKS.sub(lambda found: repr(found[0])[1:-1], f"{self.where}: {self.what}")
