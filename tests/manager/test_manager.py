"""Laws of plugin loading and calling."""

from __future__ import annotations

import importlib.metadata
import logging
import typing
from dataclasses import dataclass, fields
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

import hairkit
from hairkit import hookspecs
from hairkit.errors import HairkitError, InputError, OptionError, PluginError
from hairkit.hookspecs import hookimpl
from hairkit.manager import DISABLE_AUTOLOAD, Manager
from hairkit.options import option
from hairkit.stages import FIELD, OF_HOOK, TRACK
from hairkit.testing import combed_orientation, stage_arguments
from hairkit.types.evidence import Evidence
from hairkit.types.orientation import OrientationMap


@dataclass(frozen=True)
class _Options:
    fail: bool = option(False, doc="Raise.")


class Upright:
    """All strands are vertical."""

    Options = _Options

    def __init__(self) -> None:
        self.calls = 0

    @hookimpl
    def orient(self, mask: Any, options: _Options) -> OrientationMap:
        """Return upright strands."""
        self.calls += 1
        if options.fail:
            raise ZeroDivisionError("two\nlines")
        return combed_orientation(mask)


def orienter(answer: Any) -> object:
    """Return a plugin whose `orient` gives `answer`, or raises it."""

    class Plugin:
        @hookimpl
        def orient(self, view: Any) -> Any:
            if isinstance(answer, BaseException):
                raise answer
            return answer

    return Plugin()


def with_plugins(**plugins: object) -> Manager:
    """Return a manager of these plugins only."""
    manager = Manager()
    for name, plugin in plugins.items():
        manager.register(plugin, name, "studio-hair", "1.2")
    return manager


def entry_points(monkeypatch: pytest.MonkeyPatch, *entries: Any) -> None:
    """Let these be the installed entry points."""
    monkeypatch.setattr(importlib.metadata, "entry_points", lambda group: list(entries))


def entry(name: str, plugin: object, distribution: str = "studio-hair") -> Any:
    """Return an entry point that loads `plugin`, or raises it."""

    def load() -> object:
        if isinstance(plugin, BaseException):
            raise plugin
        return plugin

    dist = SimpleNamespace(name=distribution, version="1.2")
    return SimpleNamespace(name=name, load=load, dist=dist)


def test_the_result_types_are_those_of_the_contract() -> None:
    """What the manager accepts from each stage is what the hook's annotation says."""
    specs = {n: f for n, f in vars(hookspecs).items() if hasattr(f, "hairkit_spec")}
    assert [name for name in specs if specs[name].hairkit_spec["firstresult"]] == list(OF_HOOK)
    for stage, row in OF_HOOK.items():
        kind = row.makes
        said = typing.cast(str, specs[stage].__annotations__["return"]).removesuffix(" | None")
        assert said == kind.__name__ or (said, kind) == (
            "Simulator",
            object,
        )  # any class may be one


def test_hooks_get_all_the_evidence() -> None:
    """What is measured for field and strands reaches the plugins that make them."""
    names = [each.name for each in fields(Evidence)]
    assert list(FIELD.takes) == names
    assert set(names) <= set(TRACK.takes)


def test_only_the_named_plugin_runs() -> None:
    """A stage called on one plugin leaves all others alone."""
    first, second = Upright(), Upright()
    manager = with_plugins(first=first, second=second)
    manager.call("orient", "second", **stage_arguments("orient"))
    assert (first.calls, second.calls) == (0, 1)


def test_options_may_be_values_texts_or_ready(manager: Manager) -> None:
    """A mapping and an instance of Options do the same."""
    mine = with_plugins(upright=Upright())
    arguments = stage_arguments("orient")
    for options in ({"fail": True}, {"fail": "yes"}, _Options(fail=True)):
        with pytest.raises(PluginError, match="ZeroDivisionError"):
            mine.call("orient", "upright", options, **arguments)


def test_a_plugin_that_raises_is_named_in_one_line() -> None:
    """The error names plugin, distribution, hook and cause, and keeps the cause's traceback."""
    manager = with_plugins(upright=Upright())
    with pytest.raises(PluginError) as caught:
        manager.call("orient", "upright", {"fail": True}, **stage_arguments("orient"))
    assert str(caught.value) == (
        "plugin 'upright' of studio-hair 1.2 failed in 'orient' of view 'front':"
        " ZeroDivisionError: two lines"
    )
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


def test_a_plugins_own_hairkit_error_passes_unchanged() -> None:
    """What a plugin says to the user on purpose is not wrapped."""
    error = InputError("the photo is black")
    with pytest.raises(InputError) as caught:
        with_plugins(x=orienter(error)).call("orient", "x", **stage_arguments("orient"))
    assert caught.value is error


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (None, " returned nothing from 'orient' of view 'front'"),
        (3, ", 'orient' of view 'front': returned int, expected OrientationMap"),
    ],
)
def test_a_wrong_answer_names_the_plugin(answer: object, said: str) -> None:
    """None and the wrong type are the plugin's error, not something for later stages."""
    with pytest.raises(PluginError, match=rf"plugin 'x' of studio-hair 1.2{said}"):
        with_plugins(x=orienter(answer)).call("orient", "x", **stage_arguments("orient"))


def test_a_missing_plugin_lists_the_installed_ones() -> None:
    """The error for an unknown name tells the known ones, sorted."""
    manager = with_plugins(gabor=Upright(), block=orienter(None))
    wanted = "no plugin named 'x' implements 'orient'; installed: block, gabor"
    with pytest.raises(PluginError, match=wanted):
        manager.call("orient", "x")
    with pytest.raises(PluginError, match="named 'gabor' implements 'track'; installed: none"):
        manager.call("track", "gabor")


def test_the_first_answer_wins() -> None:
    """Plugins are tried in the given order until one has an answer."""
    upright = Upright()
    manager = with_plugins(silent=orienter(None), upright=upright, never=Upright())
    arguments = stage_arguments("orient")
    order = [("silent", None), ("upright", {}), ("never", None)]
    name, result = manager.call_first("orient", order, **arguments)
    assert name == "upright"
    assert isinstance(result, OrientationMap)
    with pytest.raises(PluginError, match=r"no plugin has an answer .* tried: silent"):
        manager.call_first("orient", [("silent", None)], **arguments)


def test_a_broken_plugin_is_recorded_and_the_rest_loads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever happens while one plugin is imported, the others are there."""
    entry_points(
        monkeypatch,
        entry("bad", ImportError("no module\nnamed x")),
        entry("exits", SystemExit(3)),
        entry("good", Upright()),
    )
    manager = Manager.loaded()
    infos = {info.name: info for info in manager.plugins()}
    assert infos["bad"].broken == "ImportError: no module named x"
    assert infos["exits"].broken is not None
    assert infos["bad"].origin == "studio-hair 1.2"
    assert manager.names("orient") == ("good",)
    with pytest.raises(PluginError, match=r"plugin .bad. of studio-hair 1\.2 is broken: Imp"):
        manager.call("orient", "bad")


def test_a_distribution_is_asked_who_it_is_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """However many plugins it has: it parses its metadata anew for every answer."""
    asked = []

    class Distribution:
        version = "1.2"

        @property
        def name(self) -> str:
            asked.append(1)
            return "studio-hair"

    shared = Distribution()
    found = [entry(name, Upright()) for name in ("up", "right", "there")]
    for one in found:
        one.dist = shared
    entry_points(monkeypatch, *found)
    assert {info.distribution for info in Manager.loaded().plugins()} == {"studio-hair"}
    assert len(asked) == 1


def misspelt() -> object:
    """Return a plugin whose hook's name is misspelt."""

    class Plugin:
        @hookimpl
        def oreint(self, view: Any) -> None:
            """Never called."""

    return Plugin()


def stranger() -> object:
    """Return a plugin that asks for an argument the hook does not have."""

    class Plugin:
        @hookimpl
        def orient(self, picture: Any) -> None:
            """Never called."""

    return Plugin()


def loose() -> object:
    """Return a plugin whose Options is a plain class."""

    class Plugin:
        class Options:
            """No dataclass."""

        @hookimpl
        def orient(self, view: Any) -> None:
            """Never called."""

    return Plugin()


@pytest.mark.parametrize(
    ("plugin", "said"),
    [
        (misspelt(), "no hook 'oreint' .did you mean 'orient'"),
        (stranger(), "picture"),
        (loose(), "not a frozen dataclass"),
        (ModuleType("empty"), "implements no hook"),
    ],
)
def test_a_plugin_that_breaks_the_contract_is_refused(plugin: object, said: str) -> None:
    """Misspelt hooks, unknown arguments, broken Options, empty plugins: refused and not kept."""
    manager = Manager()
    with pytest.raises(PluginError, match=said):
        manager.register(plugin, "x")
    assert manager.plugins() == ()
    assert manager.names("orient") == ()
    manager.register(Upright(), "x")


def test_nobody_takes_the_name_of_a_shipped_plugin(monkeypatch: pytest.MonkeyPatch) -> None:
    """hairkit's own entry points come first; the second of a name is recorded as broken."""
    own, other = Upright(), Upright()
    entry_points(monkeypatch, entry("gabor", other, "a-hair"), entry("gabor", own, "hairkit"))
    manager = Manager.loaded()
    manager.call("orient", "gabor", **stage_arguments("orient"))
    assert (own.calls, other.calls) == (1, 0)
    assert [info.broken is None for info in manager.plugins()] == [False, True]


@pytest.mark.parametrize("by_variable", [True, False])
def test_autoload_can_be_turned_off(monkeypatch: pytest.MonkeyPatch, by_variable: bool) -> None:
    """Without autoload only the shipped plugins are loaded."""
    entry_points(monkeypatch, entry("own", Upright(), "hairkit"), entry("other", Upright()))
    if by_variable:
        monkeypatch.setenv(DISABLE_AUTOLOAD, "1")
    manager = Manager.loaded(autoload=by_variable)
    assert manager.names("orient") == ("own",)


FILE_PLUGIN = '''\
"""Loaded from a file."""
from __future__ import annotations
from dataclasses import dataclass
from hairkit import hookimpl
from hairkit.options import option
from hairkit.testing import combed_orientation

@dataclass(frozen=True)
class Options:
    angle: float = option(1.0, low=0.0, doc="Angle.")

@hookimpl
def orient(mask, options):
    assert options.angle == 2.0
    return combed_orientation(mask)
'''


def test_a_file_is_a_plugin_under_its_name(tmp_path: Path) -> None:
    """`--plugin my_method.py` gives the plugin my_method with summary and options."""
    path = tmp_path / "my_method.py"
    path.write_text(FILE_PLUGIN)
    manager = Manager.loaded([path], autoload=False)
    info = manager.info("my_method")
    assert (info.summary, info.distribution) == ("Loaded from a file.", str(path))
    assert [each.name for each in info.options] == ["angle"]
    manager.call("orient", "my_method", {"angle": "2"}, **stage_arguments("orient"))


@pytest.mark.parametrize("text", ["def (", "raise SystemExit(1)", "", "import no_such_module"])
def test_a_file_that_is_no_plugin_is_an_error(tmp_path: Path, text: str) -> None:
    """A plugin file was asked for by the user: when it is broken the run stops."""
    path = tmp_path / "mine.py"
    path.write_text(text)
    with pytest.raises(PluginError, match=r"--plugin .*mine\.py: "):
        Manager.loaded([path], autoload=False)
    with pytest.raises(PluginError, match="no such file"):
        Manager.loaded([tmp_path / "other.py"], autoload=False)


class Listener:
    """Hears of grooms and falls over."""

    def __init__(self, error: Exception | None = None) -> None:
        self.heard: list[Any] = []
        self._error = error

    @hookimpl
    def stage_finished(self, stage: str) -> None:
        """Note the stage."""
        self.heard.append(stage)
        if self._error is not None:
            raise self._error


def test_notifications_reach_all_and_kill_nobody(caplog: pytest.LogCaptureFixture) -> None:
    """Every listener hears; one that raises is a warning that names it."""
    falling, standing = Listener(OSError("gone")), Listener()
    manager = with_plugins(falling=falling, standing=standing)
    with caplog.at_level(logging.WARNING, "hairkit"):
        manager.notify("stage_finished", stage="orient", seconds=1.0, result=None)
    assert falling.heard == standing.heard == ["orient"]
    assert "plugin 'falling' of studio-hair 1.2 failed in 'stage_finished'" in caplog.text


def test_values_for_a_plugin_without_options_are_refused() -> None:
    """An option of a plugin that has none is an error by name."""
    with pytest.raises(OptionError, match="x: no option 'angles'; it has none"):
        with_plugins(x=orienter(None)).options("x", {"angles": 3})


def test_the_shipped_plugins_all_work(manager: Manager) -> None:
    """Every plugin of the distribution loads, has a summary and documented options."""
    assert manager.plugins()
    for info in manager.plugins():
        assert info.broken is None, f"{info.name}: {info.broken}"
        assert info.summary.endswith(".") or ":" in info.summary, info.name
        for each in info.options:
            assert each.doc, f"{info.name}.{each.name} has no doc"
            values = {each.name: each.default}
            assert getattr(manager.options(info.name, values), each.name) == each.default


def test_every_error_is_a_hairkit_error() -> None:
    """Whoever catches HairkitError catches what the manager raises."""
    assert issubclass(PluginError, HairkitError)
    assert hairkit.HairkitError is HairkitError
