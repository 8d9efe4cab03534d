"""Damping of the rope from a ring-down: named by device.toml or of the fit itself, less that of the joint."""

from pathlib import Path

import numpy as np
import pytest

from bowdenfit.addons.device import loop as device_loop
from bowdenfit.addons.device.description import read_device
from bowdenfit.addons.device.loop import read_device_with_ring_down
from bowdenfit.addons.device.mechanics.plant import draw_device
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds.ringdown.kind import RingDownTable

pytestmark = pytest.mark.extended

DEVICE = Path(__file__).parents[3] / "datasets" / "haptic-teleoperation" / "device.toml"
STATED = 'damping = { value = 0.02, unit = "N*m*s/rad", sd = 0.004 }\nmounting'
TOTAL = 0.015 + 0.001 * np.random.default_rng(3).standard_normal((4, 1500))


class Fitted:
    """As much of a fit as is asked: its draws, and whether it has ring-downs."""

    name, converged, reasons = "bar", True, ()

    def __init__(self, total=TOTAL, rings=True):
        self.total, self.rings = total, rings
        self.dataset = self.measurements = self

    def table(self, kind):
        assert kind is RingDownTable
        return "ring-downs" if self.rings else None

    def draws(self):
        self.values = {"rope_damping": self.total, "ring_inertia": 1e-3 + 0.02 * self.total}
        return self


def device(folder, new='ringdown = "../bar"\nmounting', more=("", "")):
    text = DEVICE.read_text()
    assert text.count(STATED) == 1 and more[0] in text
    (folder / "device.toml").write_text(text.replace(STATED, new).replace(*more, 1))
    return folder / "device.toml"


@pytest.fixture
def named(monkeypatch):
    """The results that a device.toml names."""

    def put(computed):
        requests = []
        monkeypatch.setattr(device_loop, "load", lambda folder: requests.append(folder) or computed)
        return requests

    return put


def test_the_damping_of_the_joint_is_taken_from_every_draw_of_both_together(tmp_path, named):
    requests = named(Fitted())
    device_read = read_device_with_ring_down(Fitted(rings=False), device(tmp_path))
    assert requests == [tmp_path / "../bar"], "as seen from device.toml"
    keys = "rope.damping", "joint.damping"
    rope, joint = draw_device(device_read.needed("an answer", *keys), 40_000, 7).values()
    assert rope.mean() == pytest.approx(0.014, rel=0.01)
    assert np.std(rope + joint) == pytest.approx(0.001, rel=0.03), "what is known is the sum"
    assert np.corrcoef(rope, joint)[0, 1] < -0.2
    assert device_read.needed("an answer", "rope.damping")["rope.damping"].value == pytest.approx(0.014, rel=0.01)


def test_the_fits_own_ring_down_counts_and_tells_an_inertia_that_is_not_stated(tmp_path):
    path = device(tmp_path, "mounting", ('inertia = { value = 1e-3, unit = "kg*m^2", sd = 0.1e-3 }\n', ""))
    needed = read_device_with_ring_down(Fitted(), path).needed("an answer", "rope.damping", "joint.inertia", "joint.damping")
    draws = draw_device(needed, 5000, 1)
    np.testing.assert_allclose(draws["joint.inertia"], 1e-3 + 0.02 * (draws["rope.damping"] + draws["joint.damping"]))
    assert read_device_with_ring_down(Fitted(rings=False), DEVICE) == read_device(DEVICE)


@pytest.mark.parametrize(
    ("own_values", "other", "change", "says"),
    [
        (False, Fitted(), {"new": STATED.replace("\n", '\nringdown = "../bar"\n')}, "names a ring-down, which determines it"),
        (True, Fitted(), {"new": STATED}, "the fit itself has a ring-down, which determines it already"),
        (False, Fitted(rings=False), {}, "bar was fitted without a table ringdown; name the results of a fit that has one"),
        (False, Fitted(TOTAL / 30), {}, "joint.damping: 0.001 N.m.s/rad is more than the 0.000[45].* correct it"),
        (False, Fitted(), {"more": (", sd = 0.3e-3 }\n\n[rope]", " }\n\n[rope]")}, "joint.damping: 0.001 .* has no sd"),
        (False, Fitted(), {"new": "ringdown = 3\nmounting"}, "ringdown"),
    ],
)  # fmt: skip
def test_what_a_ring_down_cannot_tell_is_refused(tmp_path, named, own_values, other, change, says):
    named(other)
    with pytest.raises(DescriptionError, match=says):
        read_device_with_ring_down(Fitted(rings=own_values), device(tmp_path, **change))


def test_a_fit_that_has_not_settled_is_refused(tmp_path, named):
    doubtful = Fitted()
    doubtful.converged, doubtful.reasons = False, ("R-hat is 1.7",)
    named(doubtful)
    with pytest.raises(DescriptionError, match=r"not to be trusted \(R-hat is 1.7\); sample longer"):
        read_device_with_ring_down(Fitted(rings=False), device(tmp_path))


def test_where_nothing_tells_it_a_ring_down_is_the_remedy(tmp_path):
    with pytest.raises(
        DescriptionError, match=r"damping = \{.* under \[rope\] of device.toml, or ringdown = .*released"
    ):
        read_device(device(tmp_path, "mounting")).needed("the largest gain", "rope.damping")
