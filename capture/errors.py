"""The one error of the project: input that cannot be used."""


class InputError(ValueError):
    """Input that cannot be used: one line that names the file, the key or photo, and what was expected.

    ``where`` is the file (or ``file: key``) at fault and ``what`` the rule it broke with the offending value.
    """

    def __init__(self, where: object, what: str):
        super().__init__(str(where), what)  # as they came, else it cannot be made again in another process
        self.where = str(where)
        self.what = what

    def __str__(self) -> str:
        return f"{self.where}: {self.what}"
