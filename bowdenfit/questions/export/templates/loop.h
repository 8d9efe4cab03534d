/* Loop while it slides: sign +1 converts input to output force, -1 the reverse. */
static inline double bowden_slid(int level, double place, double speed, double force, int stroke, double sign, int *flags)
{
    const double s = stroke < 0 ? -1.0 : 1.0, along = s * force;
    const double lambda = bowden_lambda(level, place, speed, stroke, flags);
    const double taut = along - sign * bowden_at(bowden_taut_loss[level], place, 0);
    const double slack = along * exp(sign * (along > 0.0 ? -lambda : lambda));

    return s * (sign > 0.0 ? fmin(taut, slack) : fmax(taut, slack));
}
