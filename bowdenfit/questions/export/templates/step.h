/*
 * Force at the load side during any motion; call it once per sample. The force stays constant until the input has crossed
 * the friction band. output_force: the force at the previous sample on entry, the new one on return; also returned.
 * If it is NAN (before the first sample), the force starts in the middle of the band.
 */
static inline double bowden_step(int level, double place, double speed, double input_force, double *output_force, int *flags)
{
    const double low = bowden_output(level, place, speed, input_force, 1, flags);
    const double high = bowden_output(level, place, speed, input_force, -1, flags);

    if (isnan(low) || isnan(high)) {
        return NAN; /* the state is unchanged */
    }
    if (isnan(*output_force)) {
        *output_force = 0.5 * (low + high);
    } else if (*output_force < low) {
        *output_force = low;
    } else if (*output_force > high) {
        *output_force = high;
    }
    return *output_force;
}

