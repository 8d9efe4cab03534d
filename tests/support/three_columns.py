"""A recording of three columns as it must come out of any file."""

import numpy as np

TIME = [0.0, 0.01, 0.02, 0.03, 0.04]
INPUT = [6.61, 6.72, 6.63, 6.54, 6.65]
OUTPUT = [5.1, 5.2, 5.35, 5.4, 5.5]


def check(file, names=("time", "input_force", "output_force"), units=("s", "N", "N")):
    assert [channel.name for channel in file.channels] == list(names)
    assert [channel.unit for channel in file.channels] == list(units)
    for channel, values in zip(file.channels, (TIME, INPUT, OUTPUT), strict=True):
        np.testing.assert_array_equal(channel.values, values)
    for channel in file.channels[1:]:
        np.testing.assert_array_equal(channel.time, TIME)
        assert channel.clock == names[0]
