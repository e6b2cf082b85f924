"""The fit behind the published ARKit tables: it finds what is known, and makes what is shipped."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fat.profiles import ARKIT, profile_table
from fba.errors import InputFileError
from fba.scene import Role
from formats import read_face
from samples.build.arkit_anatomy import left_shapes, mirror_shape, mirrored, related
from samples.build.arkit_docs import in_words, put_tables
from samples.build.arkit_fit import fap_to_shapes, residual, shape_to_faps
from samples.build.arkit_table import makehuman_shapes, with_other_faces
from samples.build.known_shapes import KnownShapes
from samples.build.makehuman import from_folder

SMILE = {6: 90.0, 8: -200.0, 10: 150.0, 12: 500.0, 53: 90.0, 59: 500.0}


@pytest.fixture(scope="module")
def known() -> KnownShapes:
    """A face whose artist modelled with FAPs."""
    face = KnownShapes("known", read_face("default"), {})
    gaze = {23: 20000.0}
    shapes = {
        "mouthSmileLeft": face.motion(SMILE),
        "mouthSmileRight": face.motion(mirrored(SMILE)),
        "mouthFrownLeft": face.motion({12: -200.0, 59: -200.0}),
        "mouthFrownRight": face.motion({13: -200.0, 60: -200.0}),
        "eyeBlinkLeft": 1.3 * face.motion({19: 1024.0}),
        "eyeBlinkRight": 1.3 * face.motion({20: 1024.0}),
        "eyeLookOutLeft": face.motion(gaze),
        "eyeLookOutRight": face.motion(mirrored(gaze)),
        "jawOpen": face.motion({3: 700.0}),
    }
    return replace(face, shapes=shapes)


def test_the_fit_finds_what_a_shape_was_made_of(known: KnownShapes) -> None:
    found = shape_to_faps(known, "mouthSmileLeft")
    assert found.keys() == SMILE.keys()
    for number, value in SMILE.items():
        assert found[number] == pytest.approx(value, rel=0.05, abs=5), number
    left = residual(known, known.shapes["mouthSmileLeft"], known.motion(found))
    assert left.fp < 0.03
    assert left.dense < 0.03
    assert shape_to_faps(known, "jawOpen") == {3: 700}


def test_a_lid_ends_where_the_eye_is_shut(known: KnownShapes) -> None:
    assert shape_to_faps(known, "eyeBlinkLeft")[19] == 1024


def test_the_turn_of_an_eyeball_is_read_off(known: KnownShapes) -> None:
    assert shape_to_faps(known, "eyeLookOutLeft") == {23: 20000}
    values = known.values(known.motion({23: 12000.0, 25: -7000.0}))
    assert values[23] == pytest.approx(12000, abs=1)
    assert values[25] == pytest.approx(-7000, abs=1)
    assert abs(values[24]) < 1


def test_the_way_back_finds_the_shapes_weight(known: KnownShapes) -> None:
    table = {name: shape_to_faps(known, name) for name in known.shapes if name in left_shapes()}
    table |= {mirror_shape(n): {k: round(v) for k, v in mirrored(dict(f)).items()} for n, f in table.items()}
    assert fap_to_shapes(known, 12, -100, table) == {"mouthFrownLeft": 50}
    assert fap_to_shapes(known, 13, -100, table) == {"mouthFrownRight": 50}
    assert fap_to_shapes(known, 23, 10000, table) == {"eyeLookOutLeft": 50}
    assert fap_to_shapes(known, 24, -10000, table) == {"eyeLookOutRight": 50}
    assert fap_to_shapes(known, 3, 700, table) == {"jawOpen": 100}
    assert fap_to_shapes(known, 4, 100, table) == {}, "nothing moves it that way"


def test_residuals_are_zero_for_the_same_and_one_for_nothing(known: KnownShapes) -> None:
    smile = known.shapes["mouthSmileLeft"]
    same, nothing = residual(known, smile, smile), residual(known, smile, np.zeros_like(smile))
    assert (same.fp, same.dense) == (0.0, 0.0)
    assert (nothing.fp, nothing.dense) == pytest.approx((1.0, 1.0))


def test_only_what_is_seen_is_judged(known: KnownShapes) -> None:
    skin, teeth = known.of_role(Role.SKIN), known.of_role(Role.UPPER_TEETH, Role.LOWER_TEETH)
    assert known.seen[skin].mean() > 0.3
    assert not known.seen[teeth].any()
    front = int(np.argmax(np.where(skin, known.neutral[:, 2], -np.inf)))
    assert known.seen[front], "the tip of the nose"
    eyes, tongue = known.of_role(Role.EYE_LEFT, Role.EYE_RIGHT), known.of_role(Role.TONGUE)
    assert np.array_equal(known.judged(known.shapes["jawOpen"]), known.seen | eyes)
    assert np.array_equal(known.judged(np.where(tongue[:, None], known.face.fapu.es0, 0.0)), tongue)


def test_every_shape_has_its_muscles() -> None:
    for name in left_shapes():
        assert related(name)
        if mirror_shape(name) == name:
            assert {*mirrored(dict.fromkeys(related(name), 1.0))} == {*related(name)}
    assert {*left_shapes(), *map(mirror_shape, left_shapes())} == set(ARKIT)


def test_other_faces_measures_stay_with_the_same_combination() -> None:
    before = [{"shape": "a", "faps": "3:1", "ict_fp": "0.5"}, {"shape": "b", "faps": "3:2", "ict_fp": "0.6"}]
    rows = [{"shape": "a", "faps": "3:1"}, {"shape": "b", "faps": "3:9"}]
    assert [row["ict_fp"] for row in with_other_faces(rows, before)] == ["0.5", ""]
    assert with_other_faces(rows, []) == rows


def test_tables_in_words(tmp_path: Path) -> None:
    words = "12 13 59 60 raise_cornerlip 600, 41 lift_l_cheek -3, 8 9 lower_t_lip_m 5"
    assert in_words("12:600 13:600 59:600 60:600 41:-3 8:5 9:5") == words
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- t -->\nold\n<!-- end t -->\nafter\n")
    put_tables(page, {"t": "new\\1\n"})
    assert page.read_text() == "before\n<!-- t -->\nnew\\1\n<!-- end t -->\nafter\n"
    with pytest.raises(InputFileError, match="<!-- u -->"):
        put_tables(page, {"u": ""})


def test_the_shipped_table_is_what_the_fit_makes(shared: Path) -> None:
    known = makehuman_shapes(from_folder(shared / "faces" / "makehuman"), read_face("default"))
    published = {shape.name: shape for shape in profile_table("arkit")}
    for name in ("eyeLookUpLeft", "jawOpen", "mouthSmileLeft", "mouthPucker", "browDownLeft"):
        assert shape_to_faps(known, name) == published[name].faps
        left = residual(known, known.shapes[name], known.motion(published[name].faps))
        assert f"{left.dense:.2f}" == f"{published[name].residuals['makehuman_dense']:.2f}"
