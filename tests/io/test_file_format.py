"""Laws of declarations and the table that is made from them."""

from __future__ import annotations

from hairkit.cli.format_table import format_table
from hairkit.hookspecs import hookimpl
from hairkit.io.file_format import Feature, FileFormat
from hairkit.manager import Manager


class Plugin:
    """A plugin that writes a made-up format."""

    FORMAT = FileFormat(
        "Made up",
        (".mad", ".up"),
        exact=frozenset({Feature.POINTS}),
        partial={Feature.COLOUR: "in grey"},
        written=frozenset({Feature.SKIN}),
    )

    @hookimpl
    def export_groom(self, groom: object) -> bool:
        """Write nothing."""
        return True


def test_each_feature_has_one_state() -> None:
    """What is declared in no set is lost."""
    states = {feature: Plugin.FORMAT.state(feature) for feature in Feature}
    named = {feature: state for feature, state in states.items() if state}
    assert named == {Feature.POINTS: "yes", Feature.COLOUR: "in grey", Feature.SKIN: "written"}


def test_the_table_shows_states_and_notes() -> None:
    """A row for each feature, a column for each plugin, texts below."""
    manager = Manager()
    manager.register(Plugin(), "made_up")
    table = format_table(manager)
    rows = dict(line.strip("| ").split(" | ") for line in table.splitlines()[2:] if "|" in line)
    assert rows["plugin"] == "`made_up`"
    assert rows["endings"] == "`.mad` `.up`"
    assert (rows["written"], rows["read"]) == ("yes", "-")
    assert rows["points"] == "yes"
    assert rows["colour"] == "(1)"
    assert rows["skeleton and skin"] == "written"
    assert rows["physics"] == "-"
    assert table.endswith("\n\n1. in grey")
    assert set(map(str, Feature)) <= set(rows)
