"""Benches with a motor's current in place of a load cell at the input, by the balance of torques at its gear."""

import numpy as np

MU, EFFICIENCY, FRICTION, RADIUS, RATIO, CONSTANT = 0.12, 0.7, 0.09, 0.015, 26.0, 0.06  # N m, m, 1, N m/A
CABLE = '[cable]\ninput_pulley_radius = { value = 15, unit = "mm" }\n'
MOTOR = '[motor]\ntorque_constant = { value = 60, unit = "mNm/A", sd = 1 }\ngear_ratio = 26\n'
STATED = 'gear_efficiency = { value = 0.72, unit = "1", sd = 0.03 }\ngear_friction = { value = 100, unit = "mN*m", sd = 30 }\n'


def currents(bends, noise=0.0, seed=0, loads=(20, 40, 60, 80, 100), constant=CONSTANT, scatter=0.0):
    """Rows of a table, by the balance of torques at the motor."""
    rng, rows = np.random.default_rng(seed), []
    for run, bend in enumerate(bends):
        exponent = MU * np.deg2rad(bend) + scatter * rng.standard_normal() * (bend > 0)
        for load in loads:
            pulling = (load * np.exp(exponent) * RADIUS + FRICTION) / EFFICIENCY
            returning = (load * np.exp(-exponent) * RADIUS - FRICTION) * EFFICIENCY
            for stroke, torque in (("pull", pulling), ("return", returning)):
                current, output = np.array([torque / RATIO / constant, load]) * (1 + noise * rng.standard_normal(2))
                rows.append(f"{run},{stroke},{bend},{current:.8g},{output:.8g}")
    return rows


def folder_of(path, rows, motor=MOTOR, cable=CABLE, heading="input_current_A", more="", tables=""):
    path.mkdir(exist_ok=True)
    lines = [f"run,stroke,bend_deg,{heading},output_force_N", *rows]
    (path / "forces.csv").write_text("\n".join(lines) + "\n")
    (path / "cable.toml").write_text(
        f'name = "rope"\n{more}\n{cable}{motor}[[contact]]\nname = "sheath"\nfriction = "mu"\n'
        'wrap_angle = { column = "bend" }\n[tables]\nforces = { file = "forces.csv" }\n' + tables
    )
    return path


def rope_force(torque, pull):
    return (torque * EFFICIENCY - FRICTION) / RADIUS if pull else (torque / EFFICIENCY + FRICTION) / RADIUS


def recorded(bend, seed, heading="input_current (A)"):
    """CSV text: the force on the rope, and behind the cable, stand still while the motor turns around."""
    time, rng, exponent = np.arange(0, 20, 0.005), np.random.default_rng(seed), MU * np.deg2rad(bend)
    torques, output, force, rows = 1.5 * (1.05 - np.cos(2 * np.pi * time / 6)), 0.0, 0.0, []
    for torque in torques:
        force = float(np.clip(force, rope_force(torque, True), rope_force(torque, False)))
        output = float(np.clip(output, force * np.exp(-exponent), force * np.exp(exponent)))
        rows.append((torque / RATIO / CONSTANT, output))
    noisy = np.array(rows) + np.array([0.005, 0.3]) * rng.standard_normal((len(time), 2))
    lines = [f"{t:.3f},{current:.5f},{output:.4f}" for t, (current, output) in zip(time, noisy, strict=True)]
    return "\n".join([f"time (s),{heading},output_force (N)", *lines]) + "\n"


def folder_of_recordings(path, bends=(0, 45, 90, 135), motor=MOTOR, settings="", **keywords):
    path.mkdir(exist_ok=True)
    entries = []
    for i, bend in enumerate(bends):
        (path / f"{i}.csv").write_text(recorded(bend, i, **keywords))
        entries.append(f'[[recording]]\nfile = "{i}.csv"\nwrap_angles = {{ bend = {{ value = {bend}, unit = "deg" }} }}\n')
    (path / "cable.toml").write_text(
        f'name = "rope"\n[cable]\ninput_pulley_radius = {{ value = 15, unit = "mm" }}\n{motor}'
        '[[contact]]\nname = "sheath"\nfriction = "mu"\nwrap_angle = { column = "bend" }\n'
        f'[tables]\nrecordings = {{ prepare = {{ delay = "none" }}{settings} }}\n{"".join(entries)}'
    )
    return path
