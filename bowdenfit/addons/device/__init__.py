"""Devices that a cable drives: how much friction may be compensated, what a hand feels, and files for simulators.

A device is described by device.toml, beside a fit of its pull-pull loop.
"""
