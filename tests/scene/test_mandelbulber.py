"""Settings files of Mandelbulber: formulas against an independent oracle, hybrids, views, and wrong files."""

from __future__ import annotations

import random
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fracslice.errors import SceneError
from fracslice.fields.growth import compose_steps, image
from fracslice.fields.orbits import growth_of, steps
from fracslice.formulas import Node
from fracslice.scene import reads, to_xml
from fracslice.scene.mandelbulber import import_scene
from fracslice.scene.mandelbulber.measures import FAR, own_solid, solid_of, surface
from fracslice.scene.mandelbulber.objects import orbits
from fracslice.scene.mandelbulber.sequences import definition, distance_of, element, order, steps_of
from fracslice.scene.mandelbulber.settings import SettingsSection, default_of, parse_settings
from fracslice.scene.mandelbulber.step_text import ADDED, FORMULAS, OWN_SOLID, SWAPPED
from tests.examples import stamped

from . import mandelbulber_loops, mandelbulber_solids, mandelbulber_transforms
from .mandelbulber_oracle import FORMULAS as ESCAPES
from .mandelbulber_oracle import rotation as oracle_rotation
from .mandelbulber_solids import FIRST, FOURS, VARIANTS

ORACLE = {
    **ESCAPES,
    **mandelbulber_transforms.FORMULAS,
    **mandelbulber_solids.FORMULAS,
    **mandelbulber_loops.FORMULAS,
}
SOLIDS = {**mandelbulber_solids.SOLIDS, **mandelbulber_loops.SOLIDS}

pytestmark = pytest.mark.once

HEADER = "# Mandelbulber settings file\n# version 2.33\n# only modified parameters\n"

OFTEN = {2, 8, 10, 126, 207, 1100, 1108}
"""Formulas of which many points are tried in every run."""

VALUES = {  # of formulas whose defaults leave much out
    2: "power 5.5; alpha_angle_offset 20; beta_angle_offset 15",
    8: "mandelbox_scale -1.7; mandelbox_offset 0.1 0.2 -0.1; mandelbox_folding_value 1.9; "
    "mandelbox_rotations_enabled true; mandelbox_rotation_neg_2 10 20 5; mandelbox_rotation_pos_3 0 -12 40; "
    "mandelbox_main_rotation_enabled true; mandelbox_rotation_main 7 0 30",
    10: "IFS_abs_x true; IFS_enabled_0 true; IFS_direction_0 1 -1 0; IFS_enabled_3 true; "
    "IFS_direction_3 1 2 0.5; IFS_rotations_3 10 20 30; IFS_distance_3 0.2; IFS_intensity_3 0.9; "
    "IFS_rotation_enabled true; IFS_rotation 5 15 25; IFS_edge_enabled true; IFS_edge 0.7 0 1.2",
    11: "power 3; alpha_angle_offset 10; beta_angle_offset 5",
    61: "transf_rotation_enabled true; transf_rotation 10 20 30; transf_constant_multiplier_111 1 0.9 1.1; "
    "transf_function_enabledx_false true; transf_addition_constantA_000 0.1 0.2 0; transf_start_iterations 1",
    77: "transf_rotation 0 0 20; transf_addition_constant 0.1 0 0.2; transf_minimum_radius_05 0.3",
    110: "transf_offset_111 1 0.8 1.1",
    20: "transf_offset_000 0.1 0 0.2",
    59: "transf_addition_constantA_111 0.9 1 1.1; transf_scale3D_111 1 0.9 1.2",
    60: "transf_addition_constant_0555 0.5 0.6 0.4",
    64: "transf_addition_constant 0.1 0.2 0; mandelbox_folding_value 1.1; transf_minimum_radius_0 0.2",
    66: "transf_constant_multiplier_100 1 0.5 0.2; transf_angle_0 20",
    73: "transf_function_enabled_false true; transf_scale_1 0.8; "
    " transf_rotation 0 10 0; transf_minimum_radius_05 0.2",
    76: "transf_constant_julia_c 0.1 0.2 0; transf_constant_julia_mode true",
    91: "mandelbox_offset 0.1 0 0; transf_constant_multiplierA_111 1 0.9 1",
    98: "transf_function_enabledx_false true; transf_offset_000 0.1 0 0",
    114: "transf_offset_0 0.01; transf_constant_multiplier_111 1 0.5 2",
    127: "transf_function_enabledAz_false true; "
    "mandelbox_offset 0.1 0 0; transf_start_iterations_B 1; transf_addition_constant 0 0.2 0",
    135: "transf_addition_constant 0.1 0 0",
    136: "transf_minimum_radius_0 0.3",
    137: "buffalo_preabs_x true; buffalo_abs_z true; buffalo_pos_z true; transf_offset_000 0.1 0 0",
    198: "transf_offsetA_000 0.1 0 0; transf_rotation 0 0 20",
    221: "transf_int8_X 2; transf_minimum_radius_0 0.2; transf_addition_constantA_000 0.1 0 0",
    229: "power 4; transf_offset_0 0.2; transf_offsetF_000 0.1 0 0",
    244: "transf_offset 0.2; transf_addition_constant_0555 0.5 0.4 0.5; transf_int8_Y 5",
    266: "power 4; transf_scaleA_1 0.9; transf_function_enabledB_false true; transf_scaleB_0 0.5",
    222: "transf_stop_iterations_15 2; transf_minimum_radius_0 0.2; transf_scale_2 1.5",
    199: "transf_minR2_p25 0.3; transf_addition_constant_0555 0.4 0.5 0.3",
    1140: "transf_int8_X 5; transf_scaleF_1 0.9; transf_offset_000 0.1 0 0",
    1145: "transf_offset_000 -0.1 0 0; transf_addition_constant_0555 0.5 0.4 0.5",
    282: "transf_function_enabledS_false true; transf_scaleA_1 1.1",
    259: "power 3; transf_offsetA_000 0.1 0 0; transf_constant_multiplierA_111 1 0.5 1",
    92: "transf_pwr_8 3; transf_scaleA_1 0.9; beta_angle_offset 10; alpha_angle_offset 20",
    240: "transf_function_enabledB_false true; transf_offset_000 0.1 0 0",
    262: "transf_function_enabledAz_false true",
    224: "transf_int8_X 2; transf_minimum_radius_0 0.2; transf_addition_constantA_000 0.1 0 0",
    233: "transf_rotationXYZ 10 0 20; transf_offset_000 0.1 0 0; transf_constant_multiplier_111 1 0.5 1",
    1082: "transf_function_enabledAx_false true; transf_constant_multiplierC_111 2 3 1; transf_scale 1.5",
    56: "platonic_solid_frequency 2; platonic_solid_amplitude 0.8; platonic_solid_rhoMul 1.2",
    41: "buffalo_preabs_y true; buffalo_abs_x true",
    83: "transf_pwr_8 4; transf_pwr_8a 3",
    800: "transf_scaleB_1 1.2; transf_scale_1 2; transf_addition_constantA_000 0.1 0 0",
    70: "transf_offset 0.2; transf_scale 1.5; transf_addition_constant 0.1 0 0",
    1151: "transf_angle_deg_A 20; transf_angle_deg_B 30; transf_offset_000 0.1 0 0; transf_rotation 5 0 0",
    1048: "mandelbox_rotation_neg_1 10 20 0; mandelbox_rotation_pos_3 0 0 30",
    1029: "transf_addition_constant 0.5 0.6 0.7; transf_offset_000 0.4 0.5 0.6; transf_offsetA_000 0.1 0 0",
    113: "transf_rotation_enabled true; transf_rotation 0 10 0",
    119: "mandelbox_vary_scale_vary 0.1; mandelbox_offset 0.1 0 0; transf_rotation_enabled true; "
    "transf_rotation 0 0 15; transf_addition_constant_111 1 0.8 1.2",
    125: "transf_start_iterations_A 1; transf_scale 0.9",
    126: "mandelbox_offset 0 0.1 0; transf_minR2_p25 0.1",
    132: "mandelbox_main_rotation_enabled true; mandelbox_rotation_main 0 0 10; mandelbox_offset 0.1 0 0",
    186: "transf_rotation2 10 0 0; transf_offsetA_000 0.1 0 0; transf_addition_constantA_000 0 0.2 0",
    207: "transf_rotation 5 10 15; transf_rotation2 0 0 8; transf_offset_111 1 0.9 0.8",
    226: "transf_sphere_inversion_enabled_false true; transf_offset_000 0.1 0.2 2; transf_rotation2 0 9 0",
    228: "transf_rotation 10 0 0; transf_rotation2 0 20 0; transf_offset_000 0 0.1 0",
    1001: "transf_addition_constant 1 2 3; transf_addition_constantA_000 0 0 0.5",
    1002: "transf_rotation 10 20 30",
    1003: "transf_scale 1.3",
    1004: "transf_scale3D_111 1 1.5 -1",
    1005: "transf_addition_constant 0.1 0.2 0.3",
    1006: "transf_offset 0.2; transf_scale 1.1",
    1007: "transf_constant_multiplier_111 1 0.5 2",
    1020: "mandelbox_folding_value 1.8",
    1021: "mandelbox_offset 0.1 0 0; transf_scale 1.2",
    1022: "mandelbulbMulti_order_of_xyz zyx",
    1023: "transf_addition_constant 0.1 -0.2 0; transf_offsetA_000 -0.3 0 0",
    1025: "transf_addition_constant 0.5 0.6 0.7",
    1027: "power 1.5",
    1036: "transf_rotation 10 0 0; transf_offset_000 0 20 30; transf_start_iterations_250 1; "
    "transf_stop_iterations 4",
    1055: "mandelbox_offset 0.5 0 0; transf_addition_constant 0 0.1 0",
    1064: "transf_rotation 10 0 0; transf_rotation2 0 20 0; transf_offset_000 0.1 0.2 0.3",
    1065: "transf_scale3D_000 0.5 0.2 0",
    1068: "transf_function_enabled false; transf_offset_0 0.2; transf_offset 0.2",
    1080: "transf_offset_0 -0.1; transf_offsetA_0 0.2",
    1084: "transf_constant_multiplierA_111 3 1 1; transf_scaleC_1 0.8",
    1100: "transf_int8_X 5; transf_addition_constant -0.3 0 0",
    1105: "transf_addition_constant 0.3 0 0; transf_scale_1 1.4",
    1108: "transf_addition_constant_0555 0.4 0.5 0.3; transf_offsetA_000 0.1 0 0.1",
    1129: "transf_rotationXYZ 10 20 30",
    1135: "transf_constant_multiplier_111 0.1 0.2 0.3",
    1146: "transf_scaleA_1 0.4; transf_scaleB_1 0.8",
    1150: "transf_addition_constantA_000 0.1 0 0; transf_offset_222 1.5 1 1",
    71: "transf_rotation_enabled true; transf_rotation 10 0 20; transf_addition_constant 0.1 0 0; "
    "transf_scale 0.9",
    139: "transf_offset_010 0.1 1.3 0; transf_scaleA_1 0.25; transf_scaleB_1 0.5",
    218: "transf_addCpixel_enabled_false true; transf_constant_multiplier_000 0.2 0.1 0; transf_offset -0.2; "
    "transf_function_enabled_false true; transf_stop_iterations_A 1",
    219: "transf_addition_constant 0.5 0.6 0.7; transf_function_enabledC_false true; transf_int_1 3; "
    "transf_function_enabledB_false true; transf_stop_iterations_B 1; transf_scaleB_1 0.8; transf_scale 1.1; "
    "transf_function_enabled_false true; transf_stop_iterations_A 1; transf_scaleF_1 0.2; "
    "transf_offset_0 0.1",
    1152: "transf_offset_000 0.1 0 0; transf_offsetA_000 0.5 0.4 0.3",
    1155: "transf_scale 0.9; mandelbox_offset 0.2 0 0; transf_function_enabledP_false true",
    1158: "transf_addition_constant_0555 0.5 0.4 0.3; transf_offsetA_000 -0.2 0 0; transf_scale_1 1.5",
    **mandelbulber_solids.VALUES,
    **mandelbulber_loops.VALUES,
}


def text(main: str, *fractals: str) -> str:
    """Settings file of values that are separated by semicolons."""
    parts = [f"[main_parameters]\n{lines(main)}"]
    parts += [f"[fractal_{k}]\n{lines(of)}" for k, of in enumerate(fractals, 1)]
    return HEADER + "".join(parts)


def lines(values: str) -> str:
    return "".join(f"{value.strip()};\n" for value in values.split(";") if value.strip())


def orbit_nodes(source: str) -> list[Node]:
    """Element of each iteration."""
    orbit = orbits(parse_settings(source, "x.fract"))[0]
    return [element(orbit, s, definition(orbit, s, f"t{k}", 0, 1)) for k, s in enumerate(steps_of(orbit))]


def own_images(nodes: list[Node], points: np.ndarray) -> np.ndarray:
    """Last points of orbits, by our steps."""
    taken = []
    for node in nodes:
        code, given = steps(node)
        taken.append(image(code, 0, given))
    return compose_steps(taken)(points, points)


class Values(dict[str, Any]):
    """Values of a file, or their defaults, as numbers."""

    def __init__(self, section: SettingsSection) -> None:
        super().__init__()
        self.section = section

    def __missing__(self, name: str) -> Any:
        words = self.section.text(name, default_of(name)).split()
        if words[0] in ("true", "false"):
            return words[0] == "true"
        numbers = [float(word) for word in words]
        return numbers if len(numbers) > 1 else numbers[0]


def oracle_images(number: int, source: str, points: np.ndarray, count: int) -> np.ndarray:
    """Last points of orbits, by the oracle."""
    values, w = Values(parse_settings(source, "x").fractals[0]), points
    with np.errstate(all="ignore"):
        for k in range(count):
            w = ORACLE[number](w.copy(), points, values, k)
            if FORMULAS[number].constant in (ADDED, SWAPPED):
                w = w + (points[[1, 0, 2]] if FORMULAS[number].constant == SWAPPED else points)
    return w


@pytest.mark.parametrize(
    ("number", "count"), stamped([(n, 100_000) for n in sorted(ORACLE)], [(n, 100_000) for n in OFTEN])
)
def test_membership_is_that_of_the_oracle(number: int, count: int) -> None:
    """Orbits of three steps end at the same points, so each ball of the last points has the same members."""
    agrees(number, count)


@pytest.mark.parametrize("number", sorted(ORACLE))
def test_steps_are_those_of_the_oracle(number: int) -> None:
    agrees(number, 1000)


@pytest.mark.parametrize(("number", "values"), VARIANTS, ids=[str(n) for n, _ in VARIANTS])
def test_steps_with_other_switches_are_those_of_the_oracle(number: int, values: str) -> None:
    agrees(number, 1000, values)


def agrees(number: int, count: int, values: str | None = None) -> None:
    source = text(f"formula_1 {number}; N 3", VALUES.get(number, "") if values is None else values)
    points = np.random.default_rng(number).uniform(-1.6, 1.6, (3, count))
    ours, expected = own_images(orbit_nodes(source), points), oracle_images(number, source, points, 3)
    if number == 7:  # a sponge alone is written with a reflection: signs differ, which it does not notice
        ours, expected = abs(ours), abs(expected)
    sizes = np.linalg.norm(expected, axis=0)
    usual = np.isfinite(sizes) & (sizes < 1e100)
    error = np.linalg.norm(ours - expected, axis=0)[usual] / np.maximum(sizes[usual], 1)
    assert usual.mean() > 0.99
    assert np.quantile(error, 0.999) < 1e-9
    for radius in (1.0, 2.0, 6.0):
        within, known = np.linalg.norm(ours, axis=0) <= radius, sizes <= radius
        beside = abs(sizes - radius) < 1e-7
        assert (within == known)[usual & ~beside].mean() > 0.9999


@pytest.mark.parametrize("number", sorted(SOLIDS))
def test_distances_are_those_of_the_oracle(number: int) -> None:
    """Formulas with a distance of their own measure each point with that solid."""
    source = text(f"formula_1 {number}; N 1", VALUES.get(number, "") + FIRST.get(number, ""))
    orbit = orbits(parse_settings(source, "x.fract"))[0]
    count = 150 if number in mandelbulber_loops.SLOW else 1000
    kind, points = distance_of(orbit), np.random.default_rng(number).uniform(-1.6, 1.6, (3, count))
    node = surface(orbit, kind, "") if kind != OWN_SOLID else own_solid(orbit, steps_of(orbit), 0, "")
    expected = SOLIDS[number](points, Values(parse_settings(source, "x").fractals[0]))
    found = node.distance(points.T)
    if number in mandelbulber_loops.SIGNS:
        assert ((found < 0) == (expected < 0)).all() and (expected < 0).any()
    else:
        assert abs(found - expected).max() < 1e-6


def test_solids_within_a_round_are_behind_the_steps_before_them(tmp_path: Path) -> None:
    """A box before the first step, a ball after the second, in two rounds."""
    source = text(
        "hybrid_fractal_enable true; formula_1 606; formula_2 1604; N 4",
        "transf_scale_2 2; transf_offsetT_1 0.6; transf_offset_05 0.1",
        "transf_offsetR_1 0.3",
    )
    made = imported(tmp_path, source)
    assert reads(to_xml(made.scene)) == made.scene
    torus, ball = (Values(section) for section in parse_settings(source, "x").fractals[:2])
    points = np.random.default_rng(2).uniform(-1.5, 1.5, (3, 500))
    w, stretch, parts = points, 1.0, []
    for k in range(4):
        if k % 2 == 0:
            parts.append(SOLIDS[606](w[[2, 1, 0]], torus) / stretch)
            w, stretch = ORACLE[606](w, points, torus, k), 2 * stretch
        else:
            parts.append(SOLIDS[1604](w, ball) / stretch)
    cut = next(node for node in made.scene.root.walk() if node.formula.name == "bounds")
    expected = np.min(parts, axis=0)
    assert cut.fields[0].distance(points.T) == pytest.approx(expected, abs=1e-6)
    low, high = (np.array(cut[name])[:, None] for name in ("min", "max"))
    outside = ((points < low) | (points > high)).any(axis=0)
    assert not (outside & (expected < 0)).any() and outside.any()


def test_orbits_without_a_solid_or_of_four_dimensions_in_a_hybrid_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"x\.fract:6: a distance of the formulas that have none"):
        imported(tmp_path, text("formula_1 8; delta_DE_function 5"))
    with pytest.raises(SceneError, match=r"x\.fract:6: a formula of four dimensions in a hybrid"):
        imported(tmp_path, text("hybrid_fractal_enable true; formula_1 4; formula_2 8"))
    late = "transf_start_iterations 20"
    with pytest.raises(SceneError, match="a distance that begins after 12 iterations"):
        imported(tmp_path, text("formula_1 603; N 30", late))


@pytest.mark.parametrize("count", [1000, pytest.param(100_000, marks=pytest.mark.nightly)])
@pytest.mark.parametrize("number", sorted(FOURS))
def test_solids_of_four_dimensions_are_those_of_the_oracle(number: int, count: int) -> None:
    source = text(f"formula_1 {number}; N 5", VALUES.get(number, ""))
    settings = parse_settings(source, "x.fract")
    points = np.random.default_rng(number).uniform(-1.5, 1.5, (3, count))
    q, c = np.vstack([points, 0 * points[:1]]), points
    with np.errstate(all="ignore"):
        for k in range(5):
            q, c = FOURS[number](q, c, k, Values(settings.fractals[0]))
    near = np.linalg.norm(q, axis=0) < FAR
    assert (near == (solid_of(orbits(settings)[0], "").distance(points.T) < 0)).all()
    assert 0.005 < near.mean() < 0.5


def test_every_formula_has_an_oracle_and_is_in_the_manual() -> None:
    assert {*ORACLE, *FOURS} == set(FORMULAS)
    page = (Path(__file__).parents[2] / "docs/tasks/import.md").read_text(encoding="utf-8")
    rows = re.findall(r"^- \*\*[^*]+\*\*: ((?:.+\n)(?:  .+\n)*)", page, re.MULTILINE)
    listed = {" ".join(name.split()) for row in rows for name in row.split(";")}
    assert {known.name for known in FORMULAS.values()} <= listed


SOLID = "formula_1 8; N 4; hybrid_fractal_enable true; formula_2 7; formula_iterations_2 2"
"""A Mandelbox and twice a sponge; the last round is not whole."""


def test_sign_of_a_hybrid_is_that_of_the_oracle(tmp_path: Path) -> None:
    """The solid of an imported hybrid holds the points whose orbit ends within the radius of escape."""
    source = text(SOLID, "mandelbox_scale 1.5")
    made = imported(tmp_path, source).scene.root
    orbit = next(
        node for node in made.walk() if node.formula.name == "orbit" or node.values.get("iterations")
    )
    points = np.random.default_rng(0).uniform(-2, 2, (3, 5000))
    values = parse_settings(source, "x").fractals
    w, alive = points, np.ones(5000, bool)
    box, sponge = Values(values[0]), Values(values[1])
    for k, number in enumerate((8, 7, 7, 8)):
        w = ORACLE[number](w.copy(), points, box if number == 8 else sponge, k) + (
            points if number == 8 else 0
        )
    radius = growth_of(orbit).surface
    inside = np.linalg.norm(w, axis=0) <= radius
    assert ((made.distance(points.T) < 0) == (inside & alive)).mean() > 0.999
    assert 0.001 < inside.mean() < 0.5


def imported(folder: Path, source: str, **how: bool) -> Any:
    path = folder / "x.fract"
    path.write_text(source)
    return import_scene(path, **how)


def test_scene_reads_back_as_it_was_written(tmp_path: Path) -> None:
    made = imported(tmp_path, text("formula_1 207; N 2; camera 0 -3 1; fov 60,5", "transf_scale_3 2,5"))
    assert reads(to_xml(made.scene)) == made.scene
    assert made.scene.view.camera.eye == (0, -3, 1)
    assert made.scene.view.camera.fov == 60.5
    assert made.formulas == ("Menger3",)


def test_formulas_are_taken_in_turn_within_their_iterations() -> None:
    """Two of the first, one of the second from its start on; behind the last, from `repeat_from` on."""
    source = text(
        "hybrid_fractal_enable true; formula_1 8; formula_2 7; formula_3 1002; formula_iterations_1 2; "
        "formula_start_iteration_2 4; formula_stop_iteration_3 5; repeat_from 2"
    )
    orbit = orbits(parse_settings(source, "x"))[0]
    assert [s.number for s in order(orbit.slots, 2, 9)] == [8, 8, 1002, 1002, 7, 1002, 7, 7, 7]


def test_periodic_steps_are_rounds_and_others_are_unrolled(tmp_path: Path) -> None:
    made = imported(tmp_path, text("formula_1 207; N 6", "transf_rotation 0 0 10"))
    assert [n["iterations"] for n in made.scene.root.walk() if "iterations" in n.values] == [6]
    varied = text(
        "formula_1 61; N 3", "transf_rotation_enabled true; transf_start_iterations 1; transf_rotation 9 0 0"
    )
    orbit = imported(tmp_path, varied).scene.root.children[0]
    assert orbit.formula.name == "orbit" and orbit["iterations"] == 1
    assert [child["repeat"] for child in orbit.children] == [1, 2]


def test_formula_that_is_not_known_is_refused_or_left_out(tmp_path: Path) -> None:
    source = text("hybrid_fractal_enable true; formula_1 8; formula_2 1619")
    with pytest.raises(SceneError, match=r"x\.fract:7: formula_2 1619 \(transfDIFSGearV1\): not known"):
        imported(tmp_path, source)
    made = imported(tmp_path, source, leave_out=True)
    assert made.formulas == ("Mandelbox",) and "1619" in made.missing[0]
    variant = text("formula_1 119", "transf_function_enabledy_false true")
    with pytest.raises(SceneError, match=r"x\.fract:7: transf_function_enabledy_false: this variant"):
        imported(tmp_path, variant)


@pytest.mark.parametrize(
    ("version", "fov", "angle"), [("2.33", "60", 60.0), ("2.20", "1", 53.130102), ("2.20", "2", 90.0)]
)
def test_field_of_view_of_old_versions(tmp_path: Path, version: str, fov: str, angle: float) -> None:
    source = text(f"formula_1 7; fov {fov}").replace("2.33", version)
    assert imported(tmp_path, source).scene.view.camera.fov == pytest.approx(angle)


def test_lights_and_palette_of_old_versions(tmp_path: Path) -> None:
    source = text(
        "formula_1 7; main_light_alpha 30; main_light_beta 20; aux_light_enabled_1 true; "
        "aux_light_position_1 1 2 3; aux_light_intensity_1 0,8; aux_light_colour_1 ffff 0000 8000; "
        "mat1_surface_color_palette ff0000 00ff00 0000ff 123"
    ).replace("2.33", "2.13")
    made = imported(tmp_path, source).scene
    assert [light.kind for light in made.view.lights] == ["sky", "sun", "lamp"]
    assert made.view.lights[2].position == (1, 2, 3)
    assert made.view.lights[2].colour == pytest.approx((1, 0, 0.5), abs=1e-4)
    assert made.root["colour"] == (1, 0, 0, 0, 1, 0, 0, 0, 1)


WRONG = {
    "binary": (b"\0\1\2", "x.fract: not settings of Mandelbulber"),
    "text": (b"hello", "x.fract: not settings of Mandelbulber"),
    "no section": (b"# version 2.33\n", r"x.fract: expected a section \[main_parameters\]"),
    "line": (
        text("formula_1 7").encode() + b"oops\n",
        "x.fract:6: oops: expected a name, a value and a semicolon",
    ),
    "number": (text("formula_1 7; camera 1 2").encode(), "x.fract:6: camera 1 2: expected 3 numbers"),
    "huge number": (text("formula_1 7; camera 1 2 1e300").encode(), "x.fract:6: camera .*expected 3 numbers"),
    "nan": (
        text("formula_1 7", "transf_scale_3 nan").encode(),
        "x.fract:7: transf_scale_3 nan: expected a number",
    ),
    "whole": (text("formula_1 7.5").encode(), "x.fract:5: formula_1 7.5: expected a whole number"),
    "flag": (
        text("formula_1 7; julia_mode maybe").encode(),
        "x.fract:6: julia_mode maybe: expected true or false",
    ),
    "colour": (
        text("formula_1 7; background_color_1 ff").encode(),
        "x.fract:6: background_color_1 ff: expected a",
    ),
    "tree": (
        text("formula_1 5; node_0001_definition group 1,1,12,0,100").encode(),
        "x.fract:6: node_0001_definition group 1,1,12,0,100: expected one formula or a hybrid",
    ),
    "escape": (text("formula_1 1002").encode(), "x.fract: .*has orbits that do not escape"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_files_are_errors_of_one_line(tmp_path: Path, name: str) -> None:
    data, message = WRONG[name]
    path = tmp_path / "x.fract"
    path.write_bytes(data)
    with pytest.raises(SceneError, match=message) as caught:
        import_scene(path)
    assert "\n" not in str(caught.value)


def mutated(source: bytes, rng: random.Random) -> bytes:
    """A file with bytes, lines or numbers changed."""
    parts = bytearray(source)
    for _ in range(rng.randint(1, 6)):
        at = rng.randrange(len(parts))
        how = rng.randrange(5)
        if how == 0:
            parts[at] = rng.randrange(256)
        elif how == 1:
            del parts[at : at + rng.randint(1, 40)]
        elif how == 2:
            parts[at:at] = rng.choice(
                [b"1e999", b"-9", b"nan", b";", b"\n", b"true", b"[", b"99999999999", b"\0"]
            )
        elif how == 3:
            parts[at:at] = parts[at : at + 60]
        else:
            del parts[at:]
        if not parts:
            break
    return bytes(parts) or b"#"


def refusal(path: Path, begin: str) -> str:
    """Message of the error of a file, or nothing."""
    try:
        import_scene(path)
    except SceneError as error:
        return str(error) if str(error).startswith(begin) else f"{begin} expected\n{error}"
    return ""


@pytest.mark.parametrize(
    ("formula", "values", "count"),
    [
        (5, "transf_scale_3 3", 20),
        *(
            pytest.param(number, values, 50, marks=pytest.mark.nightly)
            for number, values in (
                (5, "transf_scale_3 3"),
                (271, "transf_int8_X 3; analyticDE_enabled_false true"),
                (1638, "transf_int_16 2; transf_rotation 20 0 10"),
                (1643, "transf_function_enabledA_false true"),
            )
        ),
    ],
)
def test_mutated_files_are_imported_or_refused(tmp_path: Path, formula: int, values: str, count: int) -> None:
    source = text(
        f"formula_1 {formula}; N 4; camera 0 -3 1; julia_mode true; julia_c -0.2 0.6 0; "
        "light1_color ffff 0 0",
        values,
    ).encode()
    rng, path = random.Random(7), tmp_path / "x.fract"
    for _ in range(count):
        path.write_bytes(mutated(source, rng))
        assert "\n" not in refusal(path, str(path))


def test_a_winding_without_a_thickness_is_a_surface(tmp_path: Path) -> None:
    made = imported(tmp_path, text("formula_1 1636; N 1", "transf_offset_0005 0"))
    assert any("a surface without an inside" in note for note in made.notes)


def test_objects_are_placed_and_joined(tmp_path: Path) -> None:
    """A fractal less another that is turned, scaled and moved, united with primitives in their places."""
    source = text(
        "boolean_operators true; N 3; formula_1 5; formula_2 5; boolean_operator_1 2; "
        "formula_position_2 0.5 0.1 0; formula_rotation_2 10 20 30; formula_scale_2 0.5; "
        "primitive_box_1_enabled true; primitive_box_1_position 2 0 0; primitive_box_1_rotation 0 0 45; "
        "primitive_box_1_size 1 0.5 0.2; primitive_water_1_enabled true"
    )
    made = imported(tmp_path, source)
    assert made.scene.root.formula.name == "union"
    assert "primitive_water_1: left out" in made.notes[0]
    first, second = made.scene.root.children[0].children
    points = np.random.default_rng(1).uniform(-1, 1, (3, 400))
    turned = oracle_rotation((10, 20, 30)) @ (points - [[0.5], [0.1], [0]]) / 0.5
    inside = second.distance(points.T) < 0
    assert (inside == (first.distance(turned.T) < 0)).all() and inside.any()
    corner = np.array([2 + 0.45 * np.cos(np.pi / 4), -0.45 * np.sin(np.pi / 4), 0.05])
    box = made.scene.root.children[1]
    assert box.distance(corner[None])[0] < 0 < box.distance((corner * [1, -1, 1])[None])[0]


def test_keyframes_are_tracks_of_a_film(tmp_path: Path) -> None:
    """Columns of three are vectors; what does not change has no track; the rest is noted."""
    table = (
        "[keyframes]\nframe;main_camera_x;main_camera_y;main_camera_z;fractal0_power;main_gamma;main_fov\n"
        "0;0;-3;0;8;1;50\n1;1;-3;0,5;9,5;2;50\n2;2;-3;1;10;2;50\n"
    )
    source = text("formula_1 2; N 3; frames_per_keyframe 60") + table
    made = imported(tmp_path, source)
    assert made.scene.animation.duration == 4
    assert {track.of: track.keys[1] for track in made.scene.tracks} == {
        "camera.eye": (2.0, "1.0 -3.0 0.5"),
        "mandelbulb_m.power_of": (2.0, "9.5"),
    }
    assert any("main_gamma: its keyframes are left out" in note for note in made.notes)
    assert reads(to_xml(made.scene)) == made.scene
    with pytest.raises(SceneError, match=r"x\.fract:13: keyframe of 2 values: expected 7"):
        imported(tmp_path, source + "3;4\n")
    own = (
        "[keyframes]\nframe;framesPerKeyframe;main_fov\n0;30;50\n1;90;60\n2;10;40\ninterpolation;morphAkima\n"
    )
    film = imported(tmp_path, text("formula_1 2; N 3") + own).scene
    assert film.tracks[0].keys == ((0.0, "50.0"), (1.0, "60.0"), (4.0, "40.0"))
