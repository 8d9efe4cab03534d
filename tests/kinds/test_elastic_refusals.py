"""Bad tables of stretch, preload and loops, and good ones that are remarked on."""

import pytest
from spoiled_input import copied, spoil

NAMES = ("cable.toml", "stretch.csv", "preload.csv", "loop.csv")
LOOP = """wrap_angle_deg,stroke,input_force_N,output_force_N,preload_N
45,pull,20,18,10
90,return,20,22,10
180,pull,40,33,10
"""


@pytest.fixture
def haptic(on_body, tmp_path):
    """A copy of the synthetic haptic loop to spoil, with forces in place of torques."""
    folder = copied(on_body.parent / "synthetic-haptic-loop", NAMES, tmp_path / "cable")
    (folder / "torques.csv").write_bytes((folder / "loop.csv").read_bytes())
    (folder / "loop.csv").write_text(LOOP)
    return folder


FIRST = "0,load,1,-0.2569"
S, P, L = "stretch.csv", "preload.csv", "loop.csv"
TABLES = [
    # file, what is replaced, by what, what the sentence must name
    (S, "load_N", "load", ["stretch.csv", "'load'", "does not state its unit", "load_N"]),
    (S, "load_N", "load_kg", ["'load_kg'", "mass", "kgf"]),
    (S, "stretch_mm", "stretch", ["'stretch'", "does not state its unit", "stretch_mm"]),
    (S, "stretch_mm", "stretch_N", ["'stretch_N'", "does not measure a length", "mm"]),
    (S, "stretch_mm", "elongation_mm", ["no column stretch", "'elongation_mm'", "columns ="]),
    (S, "wrap_angle_deg", "wrap_angle", ["'wrap_angle'", "does not state its unit", "wrap_angle_deg"]),
    (S, "wrap_angle_deg", "wrap_angle_mm", ["row 1", "'wrap_angle_mm'", "does not measure an angle"]),
    (S, "branch", "brench", ["row 1", "'brench'", "did you mean branch?"]),
    (S, "branch", "cycles", ["row 1", "'cycles'", "did you mean cycle?"]),
    (S, FIRST, "0,load,-1,-0.2569", ["row 2", "'load_N'", "'-1'", "negative", "tare", "write tension as positive"]),
    (S, FIRST, "0,load,,-0.2569", ["row 2", "'load_N'", "blank", "delete the row"]),
    (S, FIRST, "0,load,one,-0.2569", ["row 2", "'load_N'", "'one'", "plain number"]),
    (S, FIRST, "0,load,nan,-0.2569", ["row 2", "'load_N'", "not a finite number"]),
    (S, FIRST, "0,load,<1,-0.2569", ["row 2", "'load_N'", "'<1'", "bound", "write the value"]),
    (S, FIRST, "0,load,1,", ["row 2", "'stretch_mm'", "blank"]),
    (S, FIRST, "0,,1,-0.2569", ["row 2", "'branch'", "blank", "load", "unload"]),
    (S, FIRST, "0,sideways,1,-0.2569", ["row 2", "'branch'", "'sideways'", "unload"]),
    (S, FIRST, "-10,load,1,-0.2569", ["row 2", "'wrap_angle_deg'", "'-10'", "absolute value"]),
    (S, FIRST, "4000,load,1,-0.2569", ["row 2", "'wrap_angle_deg'", "2000 deg", "check the unit"]),
    (S, FIRST, "0,load,1,-0,2569", ["row 2", "5 cells", "decimal comma"]),
    (P, "30,2.236", "30,-2.236", ["preload.csv", "row 4", "'preload_N'", "'-2.236'", "negative", "0 for a slack rope"]),
    (P, "30,2.236", "-30,2.236", ["row 4", "'wrap_angle_deg'", "'-30'", "absolute value"]),
    (P, "30,2.236", "30,", ["row 4", "'preload_N'", "blank"]),
    (P, "30,2.236", ",2.236", ["row 4", "'wrap_angle_deg'", "blank"]),
    (P, "30,2.236", "30,<0.5", ["row 4", "'preload_N'", "'<0.5'", "bound", "0 for a slack rope"]),
    (P, "preload_N", "preload", ["'preload'", "does not state its unit", "preload_N"]),
    (P, "preload_N", "preload_mm", ["'preload_mm'", "does not measure a force"]),
    (P, "preload_N", "tension_N", ["no column preload", "'tension_N'"]),
    (L, "90,return,20,22", "90,hold,20,21", ["loop.csv", "row 3", "'stroke'", "held still", "leave the row out"]),
    (L, "90,return,20,22", "90,push,20,22", ["row 3", "'stroke'", "'push'", "pull"]),
    (L, "stroke", "strok", ["row 1", "'strok'", "did you mean stroke?"]),
    (L, "preload_N", "prelaod_N", ["row 1", "'prelaod_N'", "did you mean preload?"]),
    (L, "20,18,10", "20,18,-1", ["row 2", "'preload_N'", "'-1'", "negative"]),
    (L, "20,18,10", ",18,10", ["row 2", "'input_force_N'", "blank"]),
    (L, "20,18,10", "20,x,10", ["row 2", "'output_force_N'", "'x'", "plain number"]),
    (L, "45,pull", ",pull", ["row 2", "'wrap_angle'", "blank", "housing"]),
    (L, "45,pull", "-45,pull", ["row 2", "'wrap_angle_deg'", "'-45'"]),
    (L, "wrap_angle_deg", "bend_deg", ["no column 'wrap_angle'", "housing", "wrap_angle_deg"]),
    (L, "input_force_N", "input_force", ["'input_force'", "does not state its unit", "input_force_N"]),
    (L, "input_force_N", "input_force_N_m", ["'input_force_N_m'", "does not measure a force"]),
    (L, "input_force_N", "input_torque_N", ["'input_torque_N'", "does not measure a torque"]),
    (L, "input_force_N", "cell_7_N", ["no column input_force", "input_torque_N_m", "columns ="]),
    (L, "preload_N", "input_torque_N_m", ["both input_force and input_torque", "leave one"]),
]


@pytest.mark.parametrize(("file", "old", "new", "names"), TABLES)
def test_a_spoiled_elastic_table_is_refused_by_name(haptic, refuse, file, old, new, names):
    spoil(haptic / file, old, new)
    message = refuse("check", haptic)
    for name in [file, *names]:
        assert name in message, message


HEADS = {
    S: "wrap_angle_deg,load_N,stretch_mm",
    P: "wrap_angle_deg,preload_N",
    L: "wrap_angle_deg,input_force_N,output_force_N",
}


@pytest.mark.parametrize("file", HEADS)
@pytest.mark.parametrize(("rows", "names"), [("", "no measurements"), (None, "empty"), (False, "does not exist")])
def test_an_elastic_table_without_rows_is_refused(haptic, refuse, file, rows, names):
    if rows is False:
        (haptic / file).unlink()
    else:
        (haptic / file).write_text("" if rows is None else HEADS[file] + "\n")
    message = refuse("check", haptic)
    assert file in message
    assert names in message


FALLING = [
    ("0,10,0.5\n0,20,0.4\n0,30,0.3\n", "row 4"),
    ("0,10,0.5\n0,20,0.3\n45,10,0.6\n45,20,0.4\n90,10,0.7\n90,20,0.5\n", "row 3"),
    ("0,10,0.5\n0,20,0.6\n0,30,0.7\n45,10,0.6\n45,20,0.5\n45,30,0.4\n", "row 7"),
]


@pytest.mark.parametrize(("rows", "row"), FALLING)
def test_stretch_that_falls_with_load_is_refused_at_all_angles_or_at_one(haptic, refuse, rows, row):
    (haptic / S).write_text(f"{HEADS[S]}\n{rows}")
    message = refuse("check", haptic)
    for name in (S, row, "stretch_mm", "the stretch falls", "write stretch as positive"):
        assert name in message, message


def test_stretch_that_falls_in_a_single_pair_may_be_noise_and_is_warned_of(haptic, run):
    (haptic / S).write_text(f"{HEADS[S]}\n0,10,0.5\n0,20,0.4\n")
    code, out, _ = run("check", haptic)
    assert code == 0
    assert "Warning: in stretch.csv the stretch falls while the load grows, from row 2 to row 3" in " ".join(out.split())


def test_output_ahead_of_input_is_refused(haptic, refuse):
    (haptic / L).write_text(LOOP.replace("20,18", "18,20").replace("20,22", "22,20").replace("40,33", "33,40"))
    message = refuse("check", haptic)
    for name in (L, "row 4", "input 33 N", "output 40 N", "swapped"):
        assert name in message, message


@pytest.mark.parametrize("end", ["input", "output"])
def test_torque_without_radius_is_refused_with_the_line_to_write(haptic, refuse, end):
    spoil(haptic / "cable.toml", f'{end}_pulley_radius = {{ value = 20, unit = "mm" }}\n', "")
    (haptic / L).write_bytes((haptic / "torques.csv").read_bytes())
    message = refuse("check", haptic)
    assert f"{end}_torque" in message
    assert f'{end}_pulley_radius = {{ value = 15, unit = "mm" }}' in message


@pytest.mark.parametrize("verb", ["check", "fit"])
@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        (S, FIRST, "0,load,-1,-0.2569"),
        (P, "30,2.236", "30,-2.236"),
        (L, "90,return,20,22", "90,hold,20,21"),
        ("cable.toml", 'kind = "loop"', 'kind = "single"'),
    ],
)
def test_nothing_is_written_after_a_refused_elastic_table(haptic, refuse, tmp_path, verb, file, old, new):
    spoil(haptic / file, old, new)
    output = ["--output", tmp_path / "results"] if verb == "fit" else []
    files_at_start = sorted(tmp_path.rglob("*"))
    refuse(verb, haptic, *output)
    assert sorted(tmp_path.rglob("*")) == files_at_start


RADIUS, ANGLE = 'input_pulley_radius = { value = 20, unit = "mm" }', 'wrap_angle = { value = 90, unit = "deg" }  '
STRETCH = 'friction = "mu"      '
DESCRIPTIONS = [
    ('kind = "loop"', 'kind = "single"', ["table loop", 'kind = "loop"', "[cable]"]),
    ('kind = "loop"', 'kind = "double"', ["cable.kind", "'single' or 'loop'", "'double'"]),
    ("[cable]", 'friction_model = "capstan+drag"\n[cable]', ["loop", 'friction_model = "capstan"', "leave it out"]),
    (STRETCH, 'friction = "mu1"', ["stretch.friction 'mu1'", "belongs to no contact", "did you mean 'mu'?"]),
    (STRETCH, 'friction = "other"', ["stretch.friction 'other'", "known here: mu"]),
    (RADIUS, RADIUS.replace("20", "-20"), ["input_pulley_radius", "-20 mm", "not positive", "leave the key out"]),
    (RADIUS, RADIUS.replace("mm", "N"), ["input_pulley_radius", "'N'", "length"]),
    (RADIUS, "input_pulley_radius = 20", ["input_pulley_radius", "needs its unit", '{ value = 20, unit = "mm" }']),
    (RADIUS, "input_pulley_radius = { value = 20 }", ["input_pulley_radius", "unit is missing", 'unit = "mm"']),
    ('0.05, unit = "mm"', '0.05, unit = "deg"', ["backlash", "'deg'", "length"]),
    ('0.05, unit = "mm"', '-0.05, unit = "mm"', ["backlash", "-0.05 mm", "not positive"]),
    (ANGLE, ANGLE.replace("deg", "mm"), ["preload, wrap_angle", "'mm'", "angle"]),
    (ANGLE, ANGLE.replace("90", "-90"), ["preload, wrap_angle", "-90 deg", "2000 deg"]),
    (ANGLE, "wrap_angle = 90", ["preload.wrap_angle", "needs its unit", 'unit = "deg"']),
    ('model = "stretch"', 'value = { value = 10, unit = "mm" }', ["preload, value", "'mm'", "force"]),
    ('model = "stretch"', 'value = { value = -1, unit = "N" }', ["preload, value", "-1 N", "slack rope"]),
    ('model = "stretch"', "value = { value = 1 }", ["preload.value", "unit is missing", 'unit = "N"']),
    ('model = "stretch"', 'model = "springs"', ["preload.model", "'constant' or 'stretch'", "'springs'"]),
    ("bend_radius", "bend_radus", ["'cable.bend_radus'", "did you mean 'bend_radius'?"]),
    (STRETCH, 'frction = "mu"', ["'stretch.frction'", "did you mean 'friction'?"]),
    (ANGLE, ANGLE.replace("wrap_angle", "wrap_angel"), ["'preload.wrap_angel'", "did you mean 'wrap_angle'?"]),
    ("[stretch]", "[strech]", ["'strech'", "did you mean 'stretch'?"]),
    ('stretch = { file = "stretch.csv" }', 'stretch = { files = "*.csv" }', ["table stretch", "one file", "4"]),
    ("[tables]", "[prior.stifness]\nfixed = 3\n[tables]", ["prior.stifness", "did you mean 'stiffness'?"]),
    ("[tables]", "[prior.stiffness]\nfixed = 0\n[tables]", ["prior.stiffness", "0 is not possible", "more than 0"]),
    ("[tables]", "[prior.lengthening]\nfixed = -1\n[tables]", ["prior.lengthening", "-1 is not possible", "0 or more"]),
    ("[tables]", "[prior.preload]\nprior.normal = { mean = 3, sd = 1 }\n[tables]", ["preload cannot be negative"]),
    (
        'model = "stretch"',
        'value = { value = 10, unit = "N" }\n[prior.preload]\nfixed = 3\n[preload.x]',
        ["unknown key 'preload.x'"],
    ),
]


@pytest.mark.parametrize(("old", "new", "names"), DESCRIPTIONS)
def test_a_spoiled_elastic_description_is_refused_by_key(haptic, refuse, old, new, names):
    spoil(haptic / "cable.toml", old, new)
    message = refuse("check", haptic)
    for name in ["cable.toml", *names]:
        assert name in message, message


def test_a_preload_that_is_stated_twice_is_refused(haptic, refuse):
    spoil(haptic / "cable.toml", 'model = "stretch"', 'value = { value = 10, unit = "N" }')
    spoil(haptic / "cable.toml", "[tables]", "[prior.preload]\nfixed = 3\n[tables]")
    assert "states the preload twice" in refuse("check", haptic)


def test_a_table_of_keys_given_as_a_word_is_refused_with_how_to_write_it(haptic, refuse):
    spoil(haptic / "cable.toml", "[stretch]\n", "")
    spoil(haptic / "cable.toml", STRETCH, "")
    spoil(haptic / "cable.toml", "[cable]", 'stretch = "mu"\n[cable]')
    assert "write them under [stretch]" in refuse("check", haptic)


@pytest.mark.parametrize(
    ("file", "old", "new", "note"),
    [
        (S, "wrap_angle_deg,branch,load_N", "wrap_angle_deg,note,load_N", "although the load falls in row 13"),
        (L, "stroke", "remark", "has no stroke column"),
        (
            "cable.toml",
            'wrap_angle = { column = "wrap_angle", nominal = { value = 90, unit = "deg" } }',
            'wrap_angle = { value = 90, unit = "deg" }',
            "the column 'wrap_angle_deg', which no contact in cable.toml reads",
        ),
    ],
)
def test_what_had_to_be_assumed_is_said(haptic, run, file, old, new, note):
    spoil(haptic / file, old, new)
    code, out, err = run("check", haptic)
    assert code == 0, err
    assert note in " ".join(out.split())


def test_a_cycle_with_falling_load_only_is_remarked_on(haptic, run):
    (haptic / S).write_text(f"{HEADS[S]},branch\n0,10,0.5,unload\n0,20,0.6,unload\n90,10,0.5,load\n90,20,0.6,load\n")
    _, out, _ = run("check", haptic)
    assert "only readings with falling load at 0 deg" in out


def test_no_backlash_and_a_slack_rope_are_no_bad_input(haptic, run):
    spoil(haptic / "cable.toml", "value = 0.05", "value = 0")
    spoil(haptic / P, "0,0.303", "0,0")
    spoil(haptic / S, FIRST, "0,load,0,-0.2569")
    assert run("check", haptic)[0] == 0


def test_a_rope_that_is_only_stretched_straight_is_said_to_tell_nothing_of_friction(haptic, run):
    (haptic / S).write_text(f"{HEADS[S]}\n0,5,0.5\n0,20,0.6\n0,30,0.7\n0,40,0.8\n")
    code, out, _ = run("check", haptic)
    assert code == 0
    assert "every row of stretch.csv is at a wrap angle of 0, so it has no information on friction" in " ".join(out.split())


@pytest.mark.parametrize(("preloads", "message"), [((20, 10, 5), "falls with the wrap angle"), ((0, 0, 0), "reads 0")])
def test_preloads_that_bending_does_not_give_are_warned_of(haptic, run, preloads, message):
    rows = "\n".join(f"{angle},{preload}" for angle, preload in zip((0, 90, 180), preloads, strict=True))
    (haptic / P).write_text(f"{HEADS[P]}\n{rows}\n")
    code, out, _ = run("check", haptic)
    assert code == 0
    assert message in out
