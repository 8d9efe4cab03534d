#define BOWDEN_REFERENCE_FORCE $reference_force

/* Load exponent and drag, by level. */
static const double bowden_load[BOWDEN_LEVELS][2] = {
$load
};

/* Transform a force to the scale on which friction is the same shift at any load. */
static inline double bowden_scale(int level, double force)
{
    const double p = bowden_load[level][0], x = log((force + bowden_load[level][1]) / BOWDEN_REFERENCE_FORCE);

    return p < 1e-6 ? x * (1.0 + p * x / 2.0 * (1.0 + p * x / 3.0)) : expm1(p * x) / p;
}

/* Inverse of bowden_scale. */
static inline double bowden_force(int level, double scaled)
{
    const double p = bowden_load[level][0];
    const double x = p < 1e-6 ? scaled * (1.0 - p * scaled * (0.5 - p * scaled / 3.0))
                              : log1p(fmax(p * scaled, 1e-9 - 1.0)) / p;

    return BOWDEN_REFERENCE_FORCE * exp(x) - bowden_load[level][1];
}
