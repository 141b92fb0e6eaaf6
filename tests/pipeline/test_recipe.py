"""Laws of recipes."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from hairkit.errors import HairkitError, InputError, OptionError, PluginError
from hairkit.manager import Manager
from hairkit.nets.known_models import known_model
from hairkit.pipeline import recipe as recipe_module
from hairkit.pipeline.recipe import (
    Recipe,
    Stage,
    load_recipe,
    missing_networks,
    parse_recipe,
    recipe_names,
    stage_digest,
)
from hairkit.stages import OF_TABLE

NEEDED = "".join(
    f'[{table}]\nplugin = "{plugin}"\n'
    for table, plugin in [
        ("segment", "mask_files"),
        ("scene", "manual"),
        ("hull", "visual_hull"),
        ("field", "tensor_diffusion"),
        ("track", "certainty_tracker"),
    ]
)


def recipe_of(orient: str) -> Recipe:
    """Return a recipe whose [orient] table has this text."""
    return parse_recipe((NEEDED + "[orient]\n" + orient).encode(), "mine", "mine.toml")


def stage_of(recipe: Recipe, table: str) -> Stage:
    """Return the stage, which must be there."""
    stage = recipe.stage(table)
    assert stage is not None
    return stage


def options_of(recipe: Recipe, table: str) -> dict[str, object]:
    """Return the option values of the stage's first plugin."""
    return dict(stage_of(recipe, table).choices[0].options)


@pytest.mark.parametrize("name", recipe_names())
def test_shipped_recipes_are_valid(name: str, manager: Manager) -> None:
    """Every shipped recipe names plugins that ship, with options that they have."""
    recipe = load_recipe(name)
    recipe.check(manager)
    assert recipe.description
    assert len({stage_digest(manager, stage) for stage in recipe.stages}) == len(recipe.stages)


def test_default_and_thesis_ship() -> None:
    """The two recipes of the issue are there by name."""
    assert {"default", "thesis"} <= set(recipe_names())


def test_stages_run_in_the_order_of_the_road() -> None:
    """The order of the tables in the file does not matter."""
    recipe = recipe_of('plugin = "gabor"')
    assert [stage.table for stage in recipe.stages] == [t for t in OF_TABLE if recipe.stage(t)]


def test_options_stand_beside_the_only_plugin_or_below_its_name() -> None:
    """`[orient] angles` and `[orient.gabor] angles` mean the same."""
    flat = recipe_of('plugin = "gabor"\nangles = 8')
    below = recipe_of('plugin = "gabor"\n[orient.gabor]\nangles = 8')
    assert options_of(flat, "orient") == options_of(below, "orient") == {"angles": 8}


def test_several_plugins_have_tables_of_their_own() -> None:
    """With several plugins an option must say whose it is."""
    text = NEEDED.replace('"mask_files"', '["mask_files", "grabcut"]')
    text += '[orient]\nplugin = "gabor"\n[segment.grabcut]\nseed = 3\n'
    choices = stage_of(parse_recipe(text.encode(), "m", "m"), "segment").choices
    assert [(c.plugin, dict(c.options)) for c in choices] == [
        ("mask_files", {}),
        ("grabcut", {"seed": 3}),
    ]
    loose = text.replace("[segment.grabcut]\nseed = 3", "").replace(
        "]\n[scene", "]\nseed = 3\n[scene"
    )
    with pytest.raises(InputError, match=r"m: segment\.seed: options of several plugins"):
        parse_recipe(loose.encode(), "m", "m")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[orient", "not a TOML file"),
        ("orient = false", r"orient is False, expected a table \[orient\]$"),
        ("fit = true", r"fit is True, expected a table \[fit\], or fit = false to leave"),
        ('fit = "none"', r"fit is 'none', expected a table"),
        (
            '[oreint]\nplugin="gabor"',
            "mine.toml: oreint: no stage 'oreint' .did you mean 'orient'",
        ),
        ("orient = 3", r"orient is 3, expected a table \[orient\]$"),
        ("[segment]\nseed = 3", r"segment.seed: options of several plugins"),
        ("[orient]\nplugin = 3", "orient.plugin is 3"),
        (NEEDED + '[orient]\nplugin = ["a", "b"]', "names 2 plugins, expected one"),
        (NEEDED + "[orient]\nplugin = []", "names 0 plugins"),
        (NEEDED + '[export]\nplugin = ["a", "a"]\n[orient]\nplugin="a"', "names a plugin twice"),
        ('[export]\nfor = ["unrael"]', "no engine 'unrael' .did you mean 'unreal'"),
        ("[export]\nfor = 3", "export.for: no engine '3'; valid: unreal, unity"),
    ],
)
def test_a_wrong_recipe_is_one_line_with_file_and_key(text: str, said: str) -> None:
    """What is wrong in the file is told with the file's name and the key."""
    with pytest.raises(InputError, match=said) as caught:
        parse_recipe(text.encode(), "mine", "mine.toml")
    assert "mine.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_recipe_says_only_what_differs_from_default() -> None:
    """Stages without a table, and plugins of tables that only have options, are default's."""
    text = "[track]\ninertia = 0.5\n[segment.grabcut]\nscale = 1\n[field]\nplugin = 'mine'\n"
    recipe, default = parse_recipe(text.encode(), "mine", "mine.toml"), load_recipe("default")
    for table in ("scene", "fit", "orient", "hull", "export"):
        assert recipe.stage(table) == default.stage(table)
    assert [c.plugin for c in stage_of(recipe, "track").choices] == ["hybrid_growth"]
    assert options_of(recipe, "track") == {"inertia": 0.5}
    names = [choice.plugin for choice in stage_of(recipe, "segment").choices]
    assert names == [choice.plugin for choice in stage_of(default, "segment").choices]
    assert [dict(c.options) for c in stage_of(recipe, "segment").choices] == [{}, {"scale": 1}, {}]
    assert stage_of(recipe, "field").choices[0].plugin == "mine"
    assert load_recipe("default") == default


@pytest.mark.parametrize("table", ["fit", "export"])
def test_false_leaves_a_stage_out(table: str) -> None:
    """`fit = false` is in a file what `--set fit=none` is on the command line."""
    recipe = parse_recipe(f"{table} = false".encode(), "mine", "mine.toml")
    assert recipe.stages == load_recipe("default").with_set([f"{table}=none"]).stages
    assert recipe.stage(table) is None


@pytest.mark.parametrize("name", sorted(set(recipe_names()) - {"default"}))
def test_shipped_recipes_say_only_what_differs(name: str) -> None:
    """No table of a shipped recipe repeats the default's."""
    path = Path(recipe_module.__file__).parents[1] / "recipes" / f"{name}.toml"
    recipe, default = load_recipe(name), load_recipe("default")
    for table in set(tomllib.loads(path.read_text())) - {"description"}:
        assert recipe.stage(table) != default.stage(table)


def test_not_text_is_refused() -> None:
    """A picture named .toml is no recipe."""
    with pytest.raises(InputError, match="not a TOML file"):
        parse_recipe(b"\xff\xd8\xff", "mine", "mine.toml")


def test_a_file_is_read_like_a_shipped_recipe(tmp_path: Path) -> None:
    """A path loads the file; an unknown name lists the shipped ones."""
    path = tmp_path / "mine.toml"
    path.write_text(NEEDED + '[orient]\nplugin = "gabor"\n')
    assert load_recipe(path).name == "mine"
    with pytest.raises(
        InputError, match=r"did you mean 'thesis'.*default, patent, patent_printed, thesis"
    ):
        load_recipe("thesiss")
    with pytest.raises(InputError, match="no such file"):
        load_recipe(tmp_path / "none.toml")


def test_set_changes_one_option_and_nothing_else() -> None:
    """The new recipe has the value; the old one is as it was."""
    recipe = recipe_of('plugin = "gabor"\nangles = 8\nsigma = 2.0')
    changed = recipe.with_set(["gabor.angles=64"])
    assert options_of(changed, "orient") == {"angles": "64", "sigma": 2.0}
    assert options_of(recipe, "orient") == {"angles": 8, "sigma": 2.0}
    assert recipe.with_set([]) == recipe


def test_set_replaces_plugins_and_leaves_stages_out() -> None:
    """`orient=x` takes another plugin, `fit=none` leaves an optional stage out."""
    recipe = load_recipe("default").with_set(["orient=mine", "fit=none", "export=a,b"])
    assert [c.plugin for c in stage_of(recipe, "orient").choices] == ["mine"]
    assert recipe.stage("fit") is None
    assert [c.plugin for c in stage_of(recipe, "export").choices] == ["a", "b"]
    tables = [stage.table for stage in recipe.with_set(["fit=warp"]).stages]
    assert tables.index("scene") < tables.index("fit") < tables.index("orient")


@pytest.mark.parametrize(
    "text", ["gabor", "gabor.angles", "=3", "gabor.=3", "gobar.angles=3", "oreint=x", "orient="]
)
def test_a_wrong_set_is_refused_with_its_text(text: str) -> None:
    """The error repeats what was written."""
    with pytest.raises(HairkitError) as caught:
        recipe_of('plugin = "gabor"').with_set([text])
    assert f"--set {text}" in str(caught.value)


def test_check_names_file_table_and_plugin(manager: Manager) -> None:
    """Unknown plugins and options are found before anything runs."""
    name = manager.names("orient")[0]
    with pytest.raises(PluginError, match=r"mine.toml: \[orient\]: no plugin named 'nobody'"):
        recipe_of('plugin = "nobody"').check(with_all(manager))
    with pytest.raises(OptionError, match=rf"mine.toml: \[orient\] {name}: no option 'nothing'"):
        recipe_of(f'plugin = "{name}"\nnothing = 1').check(with_all(manager))


def with_all(manager: Manager) -> Manager:
    """Skip where the plugins of the test's recipe do not all load."""
    for hook, name in [("segment", "mask_files"), ("estimate_scene", "manual")]:
        manager.implementer(hook, name)
    return manager


def test_the_digest_knows_values_not_spelling(manager: Manager) -> None:
    """Equal options have equal digests, however written; a changed option another."""
    name = manager.names("orient")[0]
    first = next(o for o in manager.info(name).options if isinstance(o.default, (int, float)))

    def digest(text: str) -> str:
        recipe = recipe_of(f'plugin = "{name}"\n{text}')
        return stage_digest(manager, stage_of(recipe, "orient"))

    assert digest("") == digest(f"{first.name} = {first.default}")
    assert digest("") == digest(f'{first.name} = "{first.default}"')
    other = first.high if first.high is not None else first.default + 1
    assert digest("") != digest(f"{first.name} = {other}")


def test_the_digest_knows_the_files_in_a_folder(tmp_path: Path) -> None:
    """A folder that an option names counts with the files in it."""
    manager = Manager.loaded([])
    recipe = load_recipe("default").with_set(["fit=blendshapes", f"blendshapes.shapes={tmp_path}"])

    def digest() -> str:
        return stage_digest(manager, stage_of(recipe, "fit"))

    seen = {digest()}
    (tmp_path / "a.obj").write_text("v 0 0 0")
    seen.add(digest())
    (tmp_path / "a.obj").write_text("v 0 0 1")
    seen.add(digest())
    (tmp_path / "a.obj").rename(tmp_path / "b.obj")
    seen.add(digest())
    assert len(seen) == 4


def test_the_digest_knows_the_networks_that_are_there(
    manager: Manager, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A result made without a network is not taken for one made with it."""
    monkeypatch.setenv("HAIRKIT_MODELS", str(tmp_path))
    stage = stage_of(load_recipe("default"), "person")
    before = stage_digest(manager, stage)
    missing = missing_networks(load_recipe("default"), manager)["selfie"]
    assert missing == ("selfie_segmentation", "selfie_multiclass")
    for name in missing:
        known = known_model(name)
        (tmp_path / known.file).write_bytes(bytes(known.size))
    assert stage_digest(manager, stage) != before
    assert "selfie" not in missing_networks(load_recipe("default"), manager)


def test_the_example_in_the_docstring_is_toml() -> None:
    """The recipe shown in the module's docstring can be read."""
    from hairkit.pipeline import recipe

    text = (recipe.__doc__ or "").split("\n\n")[1]
    assert tomllib.loads(text)["orient"]["angles"] == 64


def test_the_old_name_of_a_stage_goes_on_with_a_line(caplog: pytest.LogCaptureFixture) -> None:
    """`head` is `fit` in recipes and `--set`; each place is named once, both names are refused."""
    new, old = (
        parse_recipe(f'[{table}]\nplugin = "blendshapes"'.encode(), "mine", "old.toml")
        for table in ("fit", "head")
    )
    assert old == new
    assert old.with_set(["head=none"]).stages == new.with_set(["fit=none"]).stages
    assert [text.partition(";")[0] for text in caplog.messages] == [
        "old.toml: the stage head is called fit since 0.3",
        "--set head=none: the stage head is called fit since 0.3",
    ]
    with pytest.raises(InputError, match=r"head is the old name of fit; write \[fit\] alone"):
        parse_recipe(b"head = false\nfit = false", "mine", "both.toml")
