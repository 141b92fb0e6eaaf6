"""Laws of reading .apx files that are damaged or made to do harm."""

from __future__ import annotations

import contextlib
import re
import tracemalloc
from itertools import pairwise
from pathlib import Path

import pytest
from hairkit_plugins import hairworks
from hypothesis import given, settings
from hypothesis import strategies as st

from hairkit.errors import FormatError, InputError
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom


def good_text() -> str:
    """Return an .apx of twelve guides of sixteen points."""
    groom = bristle_groom()
    few = Groom(
        groom.strands.select(range(12)),
        groom.head,
        groom.root_triangle[:12],
        groom.root_barycentric[:12],
    )
    return hairworks.asset_text(hairworks.exported_asset(few, hairworks.Options()))


EDITS = {
    "entity": ("<!DOCTYPE NvParameters>", '<!DOCTYPE NvParameters [<!ENTITY a "b">]>'),
    "system": (
        "<!DOCTYPE NvParameters>",
        '<!DOCTYPE NvParameters SYSTEM "file:///etc/passwd">',
    ),
    "used entity": ('type="String">hairkit', 'type="String">&boo;hairkit'),
    "root": ("NvParameters", "Parameters"),
    "class": ("HairSceneDescriptor", "HairOtherDescriptor"),
    "version": ('HairAssetDescriptor" version="1.1"', 'HairAssetDescriptor" version="2.0"'),
    "count": ('numVertices" type="U32">192', 'numVertices" type="U32">191'),
    "size": ('name="vertices" size="192"', 'name="vertices" size="999999999"'),
    "huge size": ('name="vertices" size="192"', f'name="vertices" size="{"9" * 60}"'),
    "negative": ('numBones" type="U32">3', 'numBones" type="U32">-3'),
    "bool": (">true<", ">maybe<"),
    "type": ('name="sceneUnit" type="F32"', 'name="sceneUnit" type="U32"'),
    "missing": ('<value name="upAxis" type="U32">1</value>', ""),
    "twice": ('name="upAxis"', 'name="handedness"'),
    "up axis": ('name="upAxis" type="U32">1', 'name="upAxis" type="U32">7'),
    "unit": ('name="sceneUnit" type="F32">1', 'name="sceneUnit" type="F32">0'),
    "bone": ("-1 0 1\n", "-1 0 9\n"),
}
"""What is replaced by what, by kind of damage."""


@pytest.mark.parametrize("name", EDITS)
def test_damage_is_told_in_one_line(tmp_path: Path, name: str) -> None:
    """Each kind of damage is a FormatError of one line that names the file."""
    path = tmp_path / "hair.apx"
    text = good_text()
    assert EDITS[name][0] in text
    path.write_text(text.replace(*EDITS[name]))
    with pytest.raises(FormatError) as caught:
        hairworks.import_groom(path, hairworks.Options())
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("word", ["nan", "inf", "1e39", "1_0", "0x10", "1e", "--1"])
def test_only_plain_finite_numbers_count(tmp_path: Path, word: str) -> None:
    """What Python or C might take for a number, but no .apx holds, is refused."""
    path = tmp_path / "hair.apx"
    text = good_text()
    path.write_text(re.sub(r'(type="Vec3">\s+)\S+', rf"\g<1>{word}", text, count=1))
    with pytest.raises(FormatError, match="vertices"):
        hairworks.read_apx(path)


def test_guides_of_unequal_length_are_refused(tmp_path: Path) -> None:
    """HairWorks loads no file whose guides differ in their number of points."""
    path = tmp_path / "hair.apx"
    text = good_text()
    path.write_text(text.replace("      15 31 47", "      15 30 47"))
    with pytest.raises(FormatError, match="equally many"):
        hairworks.read_apx(path)


def test_deep_nesting_is_refused(tmp_path: Path) -> None:
    """Nesting ends at the few levels an .apx has, long before any stack does."""
    path = tmp_path / "hair.apx"
    path.write_text("<!DOCTYPE NvParameters>\n" + "<value>" * 100_000)
    with pytest.raises(FormatError, match="levels"):
        hairworks.read_apx(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    """The error of a missing file names it."""
    with pytest.raises(InputError, match=r"none\.apx"):
        hairworks.read_apx(tmp_path / "none.apx")


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_damaged_bytes_give_a_groom_or_a_format_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Truncated files and flipped bytes raise FormatError or nothing, never anything else."""
    text = good_text()
    raw = bytearray(text.encode())
    if data.draw(st.booleans()):
        raw = raw[: data.draw(st.integers(0, len(raw)))]
    for _ in range(data.draw(st.integers(1, 4))):
        if raw:
            raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "hair.apx"
    path.write_bytes(raw)
    with contextlib.suppress(FormatError):
        hairworks.import_groom(path, hairworks.Options())


def laughs() -> str:
    """Return entities that would unfold to ten thousand million letters."""
    names = "abcdefghij"
    lines = ['<!ENTITY a "ha">']
    lines += [f'<!ENTITY {y} "{f"&{x};" * 10}">' for x, y in pairwise(names)]
    return f"<!DOCTYPE NvParameters [{''.join(lines)}]><NvParameters>&j;</NvParameters>"


HOSTILE = {
    "nested": "<!DOCTYPE NvParameters>" + "<value>" * 100_000,
    "many": "<!DOCTYPE NvParameters><NvParameters>" + "<a/>" * 100_000,
    "attributes": "<!DOCTYPE NvParameters><a " + " ".join(f'b{i}=""' for i in range(9999)) + "/>",
    "one word": "<!DOCTYPE NvParameters><" + "a" * 500_000,
    "laughs": laughs(),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_xml_takes_little_memory(tmp_path: Path, name: str) -> None:
    """Deep nesting, floods of elements and entities that unfold are refused early and cheaply."""
    path = tmp_path / "hair.apx"
    path.write_text(HOSTILE[name])
    tracemalloc.start()
    try:
        with pytest.raises(FormatError) as caught:
            hairworks.read_apx(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(str(caught.value)) < 500
    assert peak < 16 * 2**20
