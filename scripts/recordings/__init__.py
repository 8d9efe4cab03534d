"""The parts of scripts/benchmark_recordings.py, one a file."""
