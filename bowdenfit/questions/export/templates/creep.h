/*
 * Presliding: after a turn of the motion the rope creeps while friction builds up (docs/theory.md, presliding).
 */

/* Presliding stiffness, and damping of the bristles over their stiffness in seconds, by level. */
static const double bowden_presliding[BOWDEN_LEVELS][2] = {
$presliding
};

/* State of a rope that creeps: the force at the load side, and the friction on the scale on which it is a shift. */
typedef struct {
    double output_force, friction;
} bowden_state;

#define BOWDEN_START {NAN, 0.0} /* before the first sample: the force starts in the middle of the friction band */

static inline double bowden_to_scale(int level, double force)
{
#if BOWDEN_LOAD_DEPENDENT
    return bowden_scale(level, force);
#else
    (void)level;
    return log(force);
#endif
}

static inline double bowden_from_scale(int level, double scaled)
{
#if BOWDEN_LOAD_DEPENDENT
    return bowden_force(level, scaled);
#else
    (void)level;
    return exp(scaled);
#endif
}

/* How far the output moves while the input moves on by a change: d + build_up (1 - exp(-stiffness d)) = change. */
static inline double bowden_creep(double change, double build_up, double stiffness)
{
    const double a = log(fmax(stiffness * build_up, 1e-300)) + stiffness * (build_up - change);
    double log_w = a > 1.0 ? log(a) : a;
    int i;

    for (i = 0; i < 5; i++) { /* Newton's method for Lambert's function, from the side on which it cannot overshoot */
        const double w = exp(log_w);
        log_w -= (w + log_w - a) / (w + 1.0);
    }
    return fmin(fmax(change - build_up + exp(log_w) / stiffness, 0.0), change);
}

/*
 * Force at the load side during any motion; call it once per sample, with the time since the sample before (0 if it is not
 * known: the bristles are then not damped). Stable however long that is. The state begins as BOWDEN_START; where the result is
 * NAN it is unchanged.
 */
static inline double bowden_move(
    int level, double place, double speed, double input_force, double seconds, bowden_state *state, int *flags)
{
    double half, middle, x, y, friction, sign, build_up, lag, stiffness, moved;

    if (!bowden_valid(level, speed, input_force, flags)) {
        return NAN;
    }
    half = 0.5 * bowden_lambda(level, place, speed, 1, flags);
    middle = half;
    half += 0.5 * bowden_lambda(level, place, speed, -1, flags);
    middle = 2.0 * middle - half;
    if (isnan(half)) {
        return NAN;
    }
    x = bowden_to_scale(level, fmax(input_force, 0.0)) - middle;
    if (!(input_force > 0.0)) {
        bowden_raise(flags, BOWDEN_SLACK);
        state->output_force = state->friction = 0.0;
        return 0.0;
    }
    if (isnan(state->output_force)) {
        y = x;
        friction = 0.0;
    } else if (!(state->output_force > 0.0)) { /* it was slack, and slides */
        y = x - half;
        friction = half;
    } else {
        y = bowden_to_scale(level, state->output_force);
        friction = fmin(fmax(state->friction, -half), half);
    }
    sign = x - y - friction < 0.0 ? -1.0 : 1.0;
    build_up = half - sign * friction;
    lag = seconds > 0.0 ? bowden_presliding[level][1] / seconds : 0.0;
    stiffness = bowden_presliding[level][0] / bowden_rate(level, speed);
    moved = bowden_creep(fabs(x - y - friction), build_up * (1.0 + lag), stiffness);
    state->friction = sign * (half - build_up * exp(-stiffness * moved));
    state->output_force = bowden_from_scale(level, y + sign * moved);
    if (!(state->output_force > 0.0)) {
        bowden_raise(flags, BOWDEN_SLACK);
        state->output_force = 0.0;
    }
    return state->output_force;
}

