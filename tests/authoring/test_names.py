"""What shape names and shape maps mean."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from authoring.names import meaning, unit_name
from authoring.shape_map import parse_map
from fat.profiles.names import ARKIT, OCULUS
from fba.errors import InputFileError
from fba.faps import EXPRESSION_FAP, faps


@pytest.mark.parametrize(
    ("name", "kind", "what"),
    [
        ("open_jaw", "fap", 3),
        ("FAP3", "fap", 3),
        ("F03", "fap", 3),
        ("fap_03", "fap", 3),
        ("Head.raise_l_cornerlip", "fap", 12),
        ("raise_l_cornerlip_o", "fap", 59),
        ("viseme_PP", "viseme", 1),
        ("Viseme 14", "viseme", 14),
        ("viseme_U", "viseme", 14),
        ("aa", "viseme", 10),
        ("expression_joy", "expression", 1),
        ("Surprised", "expression", 6),
        ("Wolf3D.mouthSmileLeft", "unit", "mouthSmileLeft"),
        ("mouth_smile_l", "unit", "mouthSmileLeft"),
        ("MouthSmile.R", "unit", "mouthSmileRight"),
        ("rightMouthSmile", "unit", "mouthSmileRight"),
        ("mouthSmile", "unit", "mouthSmile"),
        ("mouthLeft", "unit", "mouthLeft"),
        ("browInnerUp_L", "unit", "browInnerUpLeft"),
        ("cheekPuff_R", "unit", "cheekPuffRight"),
        ("PupilDilate_L", "unit", "pupilDilateLeft"),
        ("eye-left-closure", "unit", "eyeBlinkLeft"),
        ("Jaw drop", "unit", "jawOpen"),
        ("viseme_sil", "ignored", None),
        ("Basis", "ignored", None),
    ],
)
def test_spellings(name: str, kind: str, what: int | str | None) -> None:
    found = meaning(name)
    assert found is not None
    assert found.kind == kind
    if what is not None:
        assert (found.unit if kind == "unit" else found.number) == what


@pytest.mark.parametrize(
    "name", ["my smile", "smile_3", "shape_F3", "FAP69", "viseme_15", "expression_7", "", "foo_aa"]
)
def test_names_that_say_nothing(name: str) -> None:
    assert meaning(name) is None


def test_every_name_of_the_standard_and_of_the_profiles_is_its_own() -> None:
    assert [meaning(f.name) and meaning(f.name).number for f in faps()[EXPRESSION_FAP:]] == list(range(3, 69))  # type: ignore[union-attr]
    assert [unit_name(name) for name in ARKIT] == list(ARKIT)
    numbers = [meaning(f"viseme_{name}").number for name in OCULUS[1:]]  # type: ignore[union-attr]
    assert numbers == list(range(1, 15))


def test_all_shapes_of_the_face_kits_are_known(shared: Path) -> None:
    for kit in ("ict-facekit", "rpm-brunette"):
        names = np.load(shared / "faces" / kit / "expressions.npz")["names"].tolist()
        assert [n for n in names if meaning(n) is None] == []
    targets = [p.name.removesuffix(".target") for p in (shared / "faces/makehuman/faceunits").iterdir()]
    assert sorted(unit_name(n) or n for n in targets) == sorted(ARKIT)


def test_a_map_in_toml() -> None:
    text = b"""
    [shapes."my smile"]
    fap = "raise_l_cornerlip"
    value = 300
    [shapes."A 1"]
    viseme = "aa"
    [shapes.glad]
    expression = 1
    [shapes.left]
    arkit = "mouth_smile_L"
    [shapes.old]
    ignore = true
    """
    found = parse_map(text, "m.toml")
    assert (found["my smile"].kind, found["my smile"].number, found["my smile"].value) == ("fap", 12, 300)
    assert (found["A 1"].kind, found["A 1"].number) == ("viseme", 10)
    assert (found["glad"].kind, found["glad"].number) == ("expression", 1)
    assert found["left"].unit == "mouthSmileLeft"
    assert found["old"].kind == "ignored"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"[shapes.a\n", "m.toml: this is not TOML"),
        (b"\xff\xfe", "UTF-8"),
        (b"", r"expected tables \[shapes"),
        (b"[targets.a]\nfap = 3", "'targets'"),
        (b'\n[shapes."a b"]\nfap = 69', "line 2, shape 'a b': there is no low-level FAP 69"),
        (b"[shapes.a]\nfap = 'jaw'", "line 1, shape 'a': there is no low-level FAP 'jaw'"),
        (b"[shapes.a]\nfap = 3\nvalue = 0", "value must be a whole number"),
        (b"[shapes.a]\nfap = 3\nvalue = 2.5", "value must be a whole number"),
        (b"[shapes.a]\nviseme = 'aa'\nvalue = 3", "value belongs to a FAP"),
        (b"[shapes.a]\nfap = 3\nunit = 'jawOpen'", "exactly one of"),
        (b"[shapes.a]\nvalue = 3", "exactly one of"),
        (b"[shapes.a]\nfaps = 3", "'faps' is not known"),
        (b"[shapes.a]\nviseme = 'xx'", "there is no viseme 'xx'"),
        (b"[shapes.a]\nexpression = 7", "there is no expression 7"),
        (b"[shapes.a]\narkit = 'jaw'", "there is no unit 'jaw'"),
        (b"shapes.a = 3", "needs a table"),
    ],
)
def test_wrong_maps_are_refused_with_the_place(text: bytes, said: str) -> None:
    with pytest.raises(InputFileError, match=said):
        parse_map(text, "m.toml")
