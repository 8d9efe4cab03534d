/* Single rope while it slides: sign +1 converts input to output force, -1 the reverse. */
static inline double bowden_slid(int level, double place, double speed, double force, int stroke, double sign, int *flags)
{
    const double shift = sign * (stroke < 0 ? -1.0 : 1.0) * bowden_lambda(level, place, speed, stroke, flags);
    double other;

    if (isnan(shift)) {
        return NAN;
    }
#if BOWDEN_LOAD_DEPENDENT
    other = bowden_force(level, bowden_scale(level, fmax(force, 0.0)) - shift);
#else
    other = force * exp(-shift);
#endif
    if (!(other > 0.0)) {
        bowden_raise(flags, BOWDEN_SLACK);
        return 0.0;
    }
    return other;
}
