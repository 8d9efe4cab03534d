"""A cable between a motor and a joint: what drives it, what controls it, what is felt. Torques in N m, angles in rad, SI."""
