"""Calls as users write them: type checkers accept what runs, and no more; a line that ends with "refused" is an error."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import bowdenfit as bf


def accepted(fit: bf.Fit) -> None:
    bf.read("my-cable", settings="friction.mu1.fixed=0.1", noise="student")
    bf.check(Path("bench.csv"), wrap_angle="180deg", columns=["input_force=F1:N"])
    bf.fit("bench.csv", wrap_angle=(180, "deg"), seed=1, output="fits/bench", mcmc=False)
    bf.predict(fit, 470, "50N")
    bf.predict(fit, [455, "470 mm", (18, "in")], input_force=(50.0, "N"), stroke="return")
    bf.predict(fit, np.array([455.0, 470.0]), output_force="22.5 lbf")
    bf.predict(fit, wrap_angles="90deg", quantity="stiffness", spring="5N/mm")
    bf.predict(fit, wrap_angles=[(90, "deg"), "180deg"], preload=(20, "N"))
    bf.predict(fit, 470, wrap_angles={"bracket edge": "45deg", "free sheath": (100, "deg")})
    bf.plot(fit, "figures", figures="efficiency", width="3.5in", formats=("pdf",))
    bf.export(fit, "c", "cable.h", at="90deg", points=51)
    bf.compensate(fit, "device.toml", wrap_angle="45deg:180deg", risk="5%")
    bf.teleoperate(fit, Path("device.toml"), wrap_angle=((45, "deg"), (180, "deg")))
    bf.certificate(fit, "laboratory.toml", output=Path("certificates"), probability=0.99)
    bf.cell("cell.xml", end="output")
    bf.next_measurement(fit, "mu1", ["angle@450", "force@470"], {"angle": 0.5})
    bf.next_measurement("fits/my-cable", top=3)
    bf.compare({"plain": fit, "rate": bf.load("fits/rate")}, leave_out="run")
    bf.pool("fits/my-fleet", until="60%", wrap_angles=["mu_sheath=180deg"], cycles=10_000)
    bf.identify("bench.toml", output=Path("answers"))
    fit.plot("efficiency", width=(3.5, "in"))
    fit.plot.efficiency(figsize=(7, 5))
    fit.plot.efficiency(ax=Figure().subplots(4))
    fit.plot("efficiency", ax=Figure().add_subplot())
    contacts = [bf.Contact("sheath", "mu", wrap_angle=(180, "deg"))]
    cable = bf.Cable("my cable", contacts, friction_model="load-dependent")
    data = cable.read(forces={"input force (N)": [20, 40], "output force (N)": np.array([17.2, 34.1])})
    bf.fit(data, seed=1)
    cable.write("my-cable", forces={"input force (N)": [20, 40], "output force (N)": [17.2, 34.1]})
    fit.profile("mu1").plot()
    bf.model(data).log_likelihood({"mu": 0.1})
    bf.report(fit, "report.html", compare="fits/before")
    fit.correlation().round(2)
    fit.posterior.to_frame()["mu1"].mean()
    fit.parameter("mu1").median + 1
    fit.summary()["seed"]
    bf.check("my-cable")
    bf.schema("cable")


def wrong(fit: bf.Fit) -> None:
    bf.predict(fit, input_force=50)  # refused
    bf.predict(fit, stroke="push")  # refused
    bf.predict("fits/my-cable")  # refused
    bf.read("my-cable", wrap_angle=180)  # refused
    bf.fit("my-cable", seed="1")  # refused
    bf.fit(123)  # refused
    bf.Contact("sheath", "mu", curve="gausian")  # refused
    bf.plot(fit, width=3.5)  # refused
    fit.plot.efficiency(figsize=7)  # refused
    fit.plot.efficiency(ax="left")  # refused
