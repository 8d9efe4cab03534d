"""Mechanics of a haptic device with a cable between motor and joint. Torques in N m, angles in rad, SI."""
