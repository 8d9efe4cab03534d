"""Whether what a figure shows comes back from the file in which it is kept."""

from bowdenfit.questions.figures import figure_data_types
from bowdenfit.results.serialization import read_arrays, serialize, write_arrays


def assert_kept(data, path):
    """Every figure's data come back from `path` as they were."""
    write_arrays(path, data)
    again = read_arrays(path, figure_data_types(data))
    assert list(again) == list(data)
    for name, array in data.items():
        assert type(again[name]) is type(array), name
        assert serialize(again[name]) == serialize(array), name
