"""Many cables, each inspected once or again and again, fitted by themselves: on one machine or on a cluster."""
