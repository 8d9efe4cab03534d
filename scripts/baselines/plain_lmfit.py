"""Least squares of the on-body tables with lmfit: the fit that bowdenfit replaces, without intervals. Needs lmfit."""

import lmfit
import numpy as np
import onbody

DATA = onbody.tables()


def residuals(parameters: lmfit.Parameters) -> np.ndarray:
    """Residuals of angles and losses, in standard deviations."""
    p = parameters.valuesdict()
    rows, angles = [], []
    for name, curve in zip(onbody.CURVES, DATA["curves"], strict=True):
        a, b, c = (p[f"{name[:-4]}_{x}"] for x in "abc")
        rows.append((curve["angle"] - np.exp(a + b * curve["z"] - c * curve["z"] ** 2)) / onbody.ANGLE_NOISE)
        angles.append(np.exp(a + b * DATA["z"] - c * DATA["z"] ** 2))
    free, squeezed = (np.where(DATA["own"], DATA["angles"][:, k], angle) for k, angle in enumerate(angles))
    loss = p["mu1"] * free + p["mu2"] * squeezed + p["mu3"] * onbody.EDGE
    return np.concatenate([*rows, (DATA["loss"] - loss) / onbody.SCATTER])


def main() -> None:
    """Fit, and print lmfit's report."""
    parameters = lmfit.Parameters()
    for name in onbody.NAMES[:3]:
        parameters.add(name, 0.12, min=0.0)
    for name, curve in zip(onbody.CURVES, DATA["curves"], strict=True):
        for letter, value in zip("abc", (curve["level"], 0.0, 1.0), strict=True):
            parameters.add(f"{name[:-4]}_{letter}", value)
    print(lmfit.fit_report(lmfit.minimize(residuals, parameters)))


if __name__ == "__main__":
    main()
