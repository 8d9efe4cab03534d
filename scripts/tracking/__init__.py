"""The parts of scripts/check_tracking.py: a simulator of benches, and Kalman filters of a textbook."""
