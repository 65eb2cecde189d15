"""What is told of a table, from the command line and back to it."""

from photogonio.arguments import build_parser
from photogonio.commands.asked import told_of
from photogonio.reconstruct.goniometer.told import ANGLES, AZIMUTHS, QUANTITIES, UNTOLD, Told


def asked(*options: str) -> Told:
    return told_of(build_parser().parse_args(["fit", "table.csv", *options]))


def test_the_command_line_says_again_what_was_told():
    told = Told(
        columns={"value": "b+a", "theta_i": "ti"},
        where=(("nm", "500"), ("run", "2")),
        quantity="percent",
        angles="radians",
        azimuth="mirror",
        channel_by="wavelength",
    )
    options = []
    for name, value in told.to_dict().items():
        pairs = value.split(",") if name == "where" else [value]
        options += [f"--{name}={one}" for one in pairs]
    assert asked(*options).to_dict() == told.to_dict()


def test_nothing_told_is_nothing_to_say():
    assert set(UNTOLD.to_dict().values()) == {None}
    assert asked().to_dict() == UNTOLD.to_dict()


def test_the_command_line_offers_what_the_reader_knows():
    for name, words in (("quantity", QUANTITIES), ("angles", ANGLES), ("azimuth", AZIMUTHS)):
        for word in words:
            assert getattr(asked(f"--{name}", word), name) == word
